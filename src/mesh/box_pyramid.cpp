// Compares a box with eight others at once. Highway compiles this file once for each SIMD target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "mesh/box_pyramid.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <bit>

#include <tbb/parallel_for.h>

#include "box_pyramid.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using Group = BoxPyramid::Group;

// Returns a bit for each box of `group` that overlaps or touches box i of `from`.
HWY_INLINE std::uint32_t overlaps(const Group& from, std::size_t i, const Group& group) {
    const hn::CappedTag<float, BoxPyramid::kWidth> d;
    std::uint32_t bits = 0;
    for (std::size_t c = 0; c < BoxPyramid::kWidth; c += hn::Lanes(d)) {
        const auto axis_overlaps = [&](std::size_t axis) HWY_ATTR {
            return hn::And(hn::Le(hn::LoadU(d, group.lower[axis] + c), hn::Set(d, from.upper[axis][i])),
                           hn::Ge(hn::LoadU(d, group.upper[axis] + c), hn::Set(d, from.lower[axis][i])));
        };
        std::uint8_t mask[8] = {};
        hn::StoreMaskBits(d, hn::And(hn::And(axis_overlaps(0), axis_overlaps(1)), axis_overlaps(2)), mask);
        bits |= static_cast<std::uint32_t>(mask[0]) << c;
    }
    return bits;
}

template <class F>
HWY_INLINE void for_each_bit(std::uint32_t bits, const F& f) {
    for (; bits != 0; bits &= bits - 1) f(static_cast<std::uint32_t>(std::countr_zero(bits)));
}

constexpr std::uint32_t from_bit(std::size_t i) {
    return ~std::uint32_t{0} << i;
}

class PairFinder {
  public:
    PairFinder(const std::vector<Buffer<Group>>& levels, std::vector<BoxPair>& pairs)
        : levels_(levels), pairs_(pairs) {}

    void find_from(std::size_t unit) {
        // The box of the unit is a box of the level above its groups.
        Group own;
        own.set(0, levels_[1][unit].bounds());
        descend(levels_.size() - 1, 0, own, unit);
    }

    void find_with(std::uint32_t box) { descend_to_boxes(levels_.size() - 1, 0, box); }

  private:
    void descend_to_boxes(std::size_t level, std::size_t at, std::uint32_t box) {
        const Group& own = levels_[0][box / BoxPyramid::kWidth];
        for_each_bit(overlaps(own, box % BoxPyramid::kWidth, levels_[level][at]), [&](std::uint32_t i) {
            const std::size_t child = BoxPyramid::kWidth * at + i;
            if (level > 0)
                descend_to_boxes(level - 1, child, box);
            else if (child != box)
                pairs_.push_back({std::min(box, static_cast<std::uint32_t>(child)),
                                  std::max(box, static_cast<std::uint32_t>(child))});
        });
    }
    // Visits the units from `unit` on below group `at` of a level.
    void descend(std::size_t level, std::size_t at, const Group& own, std::size_t unit) {
        if (level == 1) return compare_units(unit, at);
        for_each_bit(overlaps(own, 0, levels_[level][at]), [&](std::uint32_t i) {
            const std::size_t child = BoxPyramid::kWidth * at + i;
            if ((child + 1) << 3 * (level - 2) > unit) descend(level - 1, child, own, unit);
        });
    }
    HWY_INLINE void compare_units(std::size_t a, std::size_t b) {
        for (std::size_t i = 0; i < BoxPyramid::kWidth; ++i) {
            std::uint32_t bits = overlaps(levels_[1][a], i, levels_[1][b]);
            if (a == b) bits &= from_bit(i);
            for_each_bit(bits, [&](std::uint32_t j) {
                compare_groups(BoxPyramid::kWidth * a + i, levels_[1][b], j, BoxPyramid::kWidth * b + j);
            });
        }
    }
    HWY_INLINE void compare_groups(std::size_t a, const Group& bounds, std::size_t j, std::size_t b) {
        // Only the boxes of `a` that overlap the bounds of `b` can overlap its boxes.
        for_each_bit(overlaps(bounds, j, levels_[0][a]), [&](std::uint32_t i) {
            std::uint32_t bits = overlaps(levels_[0][a], i, levels_[0][b]);
            if (a == b) bits &= from_bit(i + 1);
            for_each_bit(bits, [&](std::uint32_t k) {
                pairs_.push_back({static_cast<std::uint32_t>(BoxPyramid::kWidth * a + i),
                                  static_cast<std::uint32_t>(BoxPyramid::kWidth * b + k)});
            });
        });
    }

    const std::vector<Buffer<Group>>& levels_;
    std::vector<BoxPair>& pairs_;
};

void find_pairs(const std::vector<Buffer<Group>>& levels, std::size_t unit, std::vector<BoxPair>& pairs) {
    PairFinder(levels, pairs).find_from(unit);
}

void find_pairs_with(const std::vector<Buffer<Group>>& levels, std::uint32_t box,
                     std::vector<BoxPair>& pairs) {
    PairFinder(levels, pairs).find_with(box);
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(find_pairs);
HWY_EXPORT(find_pairs_with);

void BoxPyramid::Group::set(std::size_t i, const Bounds& box) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
        lower[axis][i] = box.lower[axis];
        upper[axis][i] = box.upper[axis];
    }
}

Bounds BoxPyramid::Group::bounds() const {
    Bounds all;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        all.lower[axis] = *std::min_element(lower[axis], lower[axis] + kWidth);
        all.upper[axis] = *std::max_element(upper[axis], upper[axis] + kWidth);
    }
    return all;
}

BoxPyramid::BoxPyramid(const std::vector<Bounds>& boxes) {
    const auto add_level = [&](std::size_t count, const auto& box) {
        Buffer<Group> level((count + kWidth - 1) / kWidth);
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, level.size(), 512), [&](const auto& range) {
            for (std::size_t g = range.begin(); g < range.end(); ++g) {
                for (std::size_t i = 0; i < kWidth; ++i) {
                    const std::size_t b = kWidth * g + i;
                    level[g].set(i, b < count ? box(b) : Bounds{});
                }
            }
        });
        levels_.push_back(std::move(level));
    };
    add_level(std::max<std::size_t>(boxes.size(), 1),
              [&](std::size_t b) { return b < boxes.size() ? boxes[b] : Bounds{}; });
    do {
        const Buffer<Group>& below = levels_.back();
        add_level(below.size(), [&](std::size_t g) { return below[g].bounds(); });
    } while (levels_.back().size() > 1);
}

void BoxPyramid::pairs_from(std::size_t unit, std::vector<BoxPair>& pairs) const {
    HWY_DYNAMIC_DISPATCH(find_pairs)(levels_, unit, pairs);
}

void BoxPyramid::pairs_with(std::uint32_t i, std::vector<BoxPair>& pairs) const {
    HWY_DYNAMIC_DISPATCH(find_pairs_with)(levels_, i, pairs);
}

void BoxPyramid::set(std::uint32_t i, const Bounds& box) {
    levels_[0][i / kWidth].set(i % kWidth, box);
    std::size_t below = i / kWidth;
    for (std::size_t level = 1; level < levels_.size(); ++level, below /= kWidth)
        levels_[level][below / kWidth].set(below % kWidth, levels_[level - 1][below].bounds());
}

}  // namespace marrow::internal
#endif
