#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "../mesh/triangle_search.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "triangle_distance.h"
#include "triangle_search.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// A place, and how far boxes are from it at least. Boxes and the arithmetic on them are float: more than rounding may
// add is taken off, so that no box is passed over whose triangle, in double, would have been nearer.
class Query {
  public:
    explicit Query(const Vec3d& place) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto p = static_cast<float>(place[axis]);
            const float ulp =
                std::abs(p) * std::numeric_limits<float>::epsilon() + std::numeric_limits<float>::min();
            lower_[axis] = p - ulp;
            upper_[axis] = p + ulp;
        }
    }

    // The squared distances of the first `count` boxes, and which of them are below `most`.
    HWY_INLINE std::uint32_t near(const EightBoxes& boxes, std::uint32_t count, double most,
                                  float* to_boxes) const {
        const D d;
        std::uint32_t bits = 0;
        const auto largest = hn::Set(d, std::numeric_limits<float>::max());
        // What holds the place is near however small `most` is, also below what a float can be.
        const auto limit =
            hn::Set(d, std::max(static_cast<float>(most * 1.000001), std::numeric_limits<float>::min()));
        for (std::size_t c = 0; c < EightBoxes::kWidth; c += hn::Lanes(d)) {
            auto sum = hn::Zero(d);
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const auto below = hn::Sub(hn::LoadU(d, boxes.lower[axis] + c), hn::Set(d, upper_[axis]));
                const auto above = hn::Sub(hn::Set(d, lower_[axis]), hn::LoadU(d, boxes.upper[axis] + c));
                const auto outside = hn::Max(hn::Max(below, above), hn::Zero(d));
                sum = hn::Add(sum, hn::Mul(outside, outside));
            }
            const auto least = hn::Min(hn::Mul(sum, hn::Set(d, 0.999998f)), largest);
            hn::Store(least, d, to_boxes + c);
            std::uint8_t some[8] = {};
            hn::StoreMaskBits(d, hn::Lt(least, limit), some);
            bits |= static_cast<std::uint32_t>(some[0]) << c;
        }
        return bits & ((1u << count) - 1);
    }

  private:
    using D = hn::CappedTag<float, EightBoxes::kWidth>;
    float lower_[3], upper_[3];
};

FoundTriangle find_nearest_any(const BoxTree& tree, const Vec3d& place, double enough, double most,
                               std::uint32_t* guess) {
    constexpr std::uint32_t kNowhere = ~std::uint32_t{0};
    struct Seen {
        std::uint32_t node;
        float to_box;
    };
    Seen stack[BoxTree::kMostSeen];
    alignas(64) float to_boxes[EightBoxes::kWidth];
    const Query query(place);
    constexpr double kFar = std::numeric_limits<double>::infinity();
    // What is exactly `most` away counts.
    FoundTriangle found{most < kFar ? std::nextafter(most * most, kFar) : kFar, 0};
    const auto approach = [&](std::uint32_t node) {
        const double before = found.squared_distance;
        const BoxTree::Under under = tree.under[node];
        for (std::uint32_t bits = query.near(tree.boxes[node], under.count, before, to_boxes); bits != 0;
             bits &= bits - 1) {
            const auto child = static_cast<std::uint32_t>(hwy::Num0BitsBelowLS1Bit_Nonzero32(bits));
            if (!(to_boxes[child] < found.squared_distance)) continue;
            const PlacedCorners& t = tree.triangles[under.first + child];
            const auto corner = [](const Vec3f& p) { return Vec3d{p[0], p[1], p[2]}; };
            const double d = squared_distance_to_triangle(place, corner(t.a), corner(t.b), corner(t.c));
            if (d < found.squared_distance) found = {d, t.triangle};
        }
        return found.squared_distance < before;
    };
    std::size_t depth = 0;
    stack[depth++] = {0, 0};
    const std::uint32_t guessed = guess && tree.under[*guess].triangles ? *guess : kNowhere;
    if (guessed != kNowhere) approach(guessed);
    while (depth > 0 && found.squared_distance > enough * enough) {
        const Seen seen = stack[--depth];
        if (!(seen.to_box < found.squared_distance)) continue;
        const BoxTree::Under under = tree.under[seen.node];
        if (under.triangles) {
            if (seen.node == guessed) continue;
            if (approach(seen.node) && guess) *guess = seen.node;
            continue;
        }
        // The nearest is looked at first.
        const std::size_t first = depth;
        for (std::uint32_t bits =
                 query.near(tree.boxes[seen.node], under.count, found.squared_distance, to_boxes);
             bits != 0; bits &= bits - 1) {
            const auto child = static_cast<std::uint32_t>(hwy::Num0BitsBelowLS1Bit_Nonzero32(bits));
            Seen next{under.first + child, to_boxes[child]};
            if (depth > first && stack[depth - 1].to_box < next.to_box) std::swap(stack[depth - 1], next);
            stack[depth++] = next;
        }
    }
    return found;
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(find_nearest_any);

FoundTriangle find_nearest(const BoxTree& tree, const Vec3d& place, double enough, double most,
                           std::uint32_t* guess) {
    return HWY_DYNAMIC_DISPATCH(find_nearest_any)(tree, place, enough, most, guess);
}

}  // namespace marrow::internal
#endif
