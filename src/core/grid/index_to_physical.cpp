// Derives the single-precision matrices from the geometry.
#include "index_to_physical.h"

namespace marrow::internal {

IndexToPhysical::IndexToPhysical(const VolumeView& volume)
    : first(volume.first), origin(volume.geometry.origin), exact(volume.geometry.index_to_physical()) {
    // Gradients map by the inverse transpose. The cofactors are the inverse transpose times the determinant.
    // Normals are unit vectors, so only the sign of the factor matters.
    const Mat3d cofactor = cofactors(exact);
    mirrored = dot(exact[0], cofactor[0]) < 0;

    double largest = 0;
    for (const Vec3d& row : cofactor) {
        for (const double value : row) largest = std::max(largest, std::abs(value));
    }
    const double scale = (mirrored ? 1 : -1) / largest;  // negative: normals point down the gradient
    for (std::size_t r = 0; r < 3; ++r) {
        for (std::size_t c = 0; c < 3; ++c) {
            matrix[r][c] = static_cast<float>(exact[r][c]);
            normal_matrix[r][c] = static_cast<float>(cofactor[r][c] * scale);
            axis[c][r] = static_cast<float>(exact[r][c] / std::hypot(exact[0][c], exact[1][c], exact[2][c]));
        }
    }
}

Vec3f IndexToPhysical::row_base(std::int64_t y, std::int64_t z) const noexcept {
    Vec3f base;
    for (std::size_t r = 0; r < 3; ++r) {
        base[r] = static_cast<float>(origin[r] + exact[r][1] * static_cast<double>(first[1] + y) +
                                     exact[r][2] * static_cast<double>(first[2] + z));
    }
    return base;
}

}  // namespace marrow::internal
