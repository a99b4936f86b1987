/// The point on a crossed grid edge: the one formula that all extraction methods share, bit for bit.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <type_traits>

#include <marrow/mesh.h>
#include <marrow/volume.h>

namespace marrow::internal {

/// The type for arithmetic with samples: float if it holds every sample and every difference exactly, else
/// double.
template <class T>
using Real = std::conditional_t<sizeof(T) <= 2 || std::is_same_v<T, float>, float, double>;

/// Floating-point samples are halved before use, so that the difference of two huge ones does not overflow.
template <class T>
constexpr Real<T> kSampleScale = std::is_floating_point_v<T> ? Real<T>(0.5) : Real<T>(1);

/// Points stay this far from both ends of their edge, as a fraction of it. Otherwise the points on all edges
/// around a sample that equals the isovalue would lie on the sample. Triangles between them would have no
/// area, and a reader that joins points by their coordinates, as every reader of STL does, would find edges
/// of four triangles.
inline constexpr float kLeastFraction = 1.0f / 1024;

/// The position of the isovalue along an edge, from kLeastFraction to 1 - kLeastFraction. It is 0.5 if an end
/// is not finite. All arguments are multiplied by kSampleScale.
template <class R>
R edge_fraction(R first, R second, R isovalue) {
    const R difference = second - first;
    const R t = (isovalue - first) / difference;
    if (!(std::abs(difference) <= std::numeric_limits<R>::max()) || std::isnan(t)) return R(0.5);
    return std::min(std::max(t, R(kLeastFraction)), R(1 - kLeastFraction));
}

/// Maps indices of a view to physical space. The start of each row is computed in double precision, and
/// positions within the row in single precision. Both start from indices in the whole volume, so that a part
/// of a volume gets the same bits.
struct IndexToPhysical {
    explicit IndexToPhysical(const VolumeView& volume);

    /// The position of the whole volume's sample with x = 0 in row (y, z) of the view.
    Vec3f row_base(std::int64_t y, std::int64_t z) const noexcept;

    /// The position of the point at fraction t along `axis` from the sample of the row whose x in the whole
    /// volume is `x`.
    Vec3f point(const Vec3f& base, float x, std::size_t axis, float t) const {
        Vec3f p;
        for (std::size_t r = 0; r < 3; ++r) p[r] = (base[r] + matrix[r][0] * x) + matrix[r][axis] * t;
        return p;
    }

    std::array<std::int64_t, 3> first;  ///< index in the whole volume of the view's first sample
    Vec3d origin;
    Mat3d exact;                         ///< the linear part of index -> physical
    std::array<Vec3f, 3> matrix;         ///< the same in single precision
    std::array<Vec3f, 3> normal_matrix;  ///< index gradient -> direction down the gradient, of any length
    std::array<Vec3f, 3> axis;           ///< unit direction of each index axis
    bool mirrored;                       ///< the map mirrors, so the winding of triangles flips
};

}  // namespace marrow::internal
