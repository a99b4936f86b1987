#include "index_to_physical.h"

namespace marrow::internal {

IndexToPhysical::IndexToPhysical(const Geometry& geometry)
    : origin(geometry.origin), exact(geometry.index_to_physical()) {
    const Mat3d& m = exact;
    // Gradients map by the inverse transpose, which is the cofactor matrix but for a factor; its sign turns
    // them down.
    Mat3d cofactor;
    for (std::size_t r = 0; r < 3; ++r) {
        const std::size_t r1 = (r + 1) % 3, r2 = (r + 2) % 3;
        for (std::size_t c = 0; c < 3; ++c) {
            const std::size_t c1 = (c + 1) % 3, c2 = (c + 2) % 3;
            cofactor[r][c] = m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1];
        }
    }
    const double determinant = m[0][0] * cofactor[0][0] + m[0][1] * cofactor[0][1] + m[0][2] * cofactor[0][2];
    mirrored = determinant < 0;

    double largest = 0;
    for (const Vec3d& row : cofactor) {
        for (double value : row) largest = std::max(largest, std::abs(value));
    }
    const double scale = (mirrored ? 1 : -1) / largest;
    for (std::size_t r = 0; r < 3; ++r) {
        for (std::size_t c = 0; c < 3; ++c) {
            matrix[r][c] = static_cast<float>(m[r][c]);
            normal_matrix[r][c] = static_cast<float>(cofactor[r][c] * scale);
            axis[c][r] = static_cast<float>(m[r][c] / std::hypot(m[0][c], m[1][c], m[2][c]));
        }
    }
}

Vec3f IndexToPhysical::row_base(std::int64_t y, std::int64_t z) const {
    Vec3f base;
    for (std::size_t r = 0; r < 3; ++r) {
        base[r] = static_cast<float>(origin[r] + exact[r][1] * static_cast<double>(y) +
                                     exact[r][2] * static_cast<double>(z));
    }
    return base;
}

}  // namespace marrow::internal
