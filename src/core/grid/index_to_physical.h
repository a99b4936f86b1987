/// From a crossed edge of the grid to a point in space: the one formula that every path shares, bit for bit.
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

/// The arithmetic type of a sample type: float where it holds every sample and difference, else double.
template <class T>
using Real = std::conditional_t<sizeof(T) <= 2 || std::is_same_v<T, float>, float, double>;

/// Floating-point samples are halved first, so that the difference of two huge ones does not overflow.
template <class T>
constexpr Real<T> kSampleScale = std::is_floating_point_v<T> ? Real<T>(0.5) : Real<T>(1);

/// How far along an edge the isovalue lies, in [0, 1]; the middle where an end is not finite. Arguments are
/// scaled.
template <class R>
R edge_fraction(R first, R second, R isovalue) {
    const R difference = second - first;
    const R t = (isovalue - first) / difference;
    if (!(std::abs(difference) <= std::numeric_limits<R>::max()) || std::isnan(t)) return R(0.5);
    return std::min(std::max(t, R(0)), R(1));
}

/// A volume's index-to-physical map, as single precision about rows that are placed in double.
struct IndexToPhysical {
    explicit IndexToPhysical(const Geometry& geometry);

    /// The position of index (0, y, z).
    Vec3f row_base(std::int64_t y, std::int64_t z) const;

    /// The position of the point at fraction t along `axis` from sample x of the row.
    Vec3f point(const Vec3f& base, float x, std::size_t axis, float t) const {
        Vec3f p;
        for (std::size_t r = 0; r < 3; ++r) p[r] = (base[r] + matrix[r][0] * x) + matrix[r][axis] * t;
        return p;
    }

    Vec3d origin;
    Mat3d exact;
    std::array<Vec3f, 3> matrix;  ///< index -> physical
    std::array<Vec3f, 3>
        normal_matrix;          ///< index gradient -> physical direction down the gradient, unnormalised
    std::array<Vec3f, 3> axis;  ///< unit physical direction of each index axis
    bool mirrored;              ///< the map turns a left-handed index to_physical into space: winding flips
};

}  // namespace marrow::internal
