// Loads points into vectors. Each SIMD target includes this file once.
#if defined(MARROW_LOAD_POINTS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MARROW_LOAD_POINTS_INL_H
#undef MARROW_LOAD_POINTS_INL_H
#else
#define MARROW_LOAD_POINTS_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include <marrow/mesh.h>
#include <marrow/vector.h>

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

#if HWY_TARGET != HWY_SCALAR
// Loads four floats from address(block) into each block of four lanes.
template <class D, class Address>
HWY_INLINE hn::Vec<D> load_blocks(D d, const Address& address) {
    if constexpr (hn::MaxLanes(D()) <= 4) {
        return hn::LoadU(d, address(0));
    } else {
        const hn::Half<D> half;
        const auto upper = [&](std::size_t block) { return address(block + hn::MaxLanes(D()) / 8); };
        return hn::Combine(d, load_blocks(half, upper), load_blocks(half, address));
    }
}
#endif

// Loads four floats at address(lane) into each lane.
template <class D, class Address>
HWY_INLINE void load_fours(D d, const Address& address, hn::Vec<D> (&fours)[4]) {
#if HWY_TARGET == HWY_SCALAR
    HWY_ALIGN float rows[4 * hn::MaxLanes(D())] = {};
    for (std::size_t lane = 0; lane < hn::Lanes(d); ++lane) std::copy_n(address(lane), 4, rows + 4 * lane);
    hn::LoadInterleaved4(d, rows, fours[0], fours[1], fours[2], fours[3]);
#else
    // Blocks of four floats, side by side, are transposed.
    const auto every_fourth = [&](std::size_t first) HWY_ATTR {
        return load_blocks(d, [&](std::size_t block) { return address(4 * block + first); });
    };
    const auto p0 = every_fourth(0), p1 = every_fourth(1), p2 = every_fourth(2), p3 = every_fourth(3);
    const auto lower02 = hn::InterleaveLower(d, p0, p2), lower13 = hn::InterleaveLower(d, p1, p3),
               upper02 = hn::InterleaveUpper(d, p0, p2), upper13 = hn::InterleaveUpper(d, p1, p3);
    fours[0] = hn::InterleaveLower(d, lower02, lower13);
    fours[1] = hn::InterleaveUpper(d, lower02, lower13);
    fours[2] = hn::InterleaveLower(d, upper02, upper13);
    fours[3] = hn::InterleaveUpper(d, upper02, upper13);
#endif
}

// Loads points of a mesh, one into each lane. It reads four floats at each; no fourth one follows the last
// point, so there is a copy of that.
class PointLoader {
  public:
    explicit PointLoader(std::span<const Vec3f> points) : points_(points.data()), last_(points.size() - 1) {
        if (!points.empty()) std::copy(points.back().begin(), points.back().end(), padded_);
    }

    // Loads the point with the number point_of(lane) into each lane.
    template <class D, class PointOf>
    HWY_INLINE void load(D d, const PointOf& point_of, hn::Vec<D> (&xyz)[3]) const {
        hn::Vec<D> fours[4];
        load_fours(
            d, [&](std::size_t lane) { return floats(point_of(lane)); }, fours);
        for (std::size_t axis = 0; axis < 3; ++axis) xyz[axis] = fours[axis];
    }

  private:
    HWY_INLINE const float* floats(std::size_t point) const {
        return point == last_ ? padded_ : points_[point].data();
    }

    const Vec3f* points_;
    std::size_t last_;
    float padded_[4] = {};
};

// Returns `count` triangles, at most as many as there are lanes, as an array with one for each lane. If there
// are fewer, that is `padded`, where the last one fills the other lanes.
HWY_INLINE const Triangle* in_all_lanes(const Triangle* triangles, std::size_t count, std::size_t lanes,
                                        Triangle* padded) {
    if (count == lanes) return triangles;
    for (std::size_t lane = 0; lane < lanes; ++lane) padded[lane] = triangles[std::min(lane, count - 1)];
    return padded;
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
