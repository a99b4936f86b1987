// Finds the nearest triangle of a tree. Highway compiles this file once for each SIMD target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "mesh/triangle_search.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "triangle_distance.h"
#include "triangle_search.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Computes lower bounds of the distances from a position to boxes. The arithmetic is float, so the bounds are
// reduced by more than the rounding error. Otherwise a search could skip a box that contains the nearest
// triangle.
class Query {
  public:
    explicit Query(const Vec3d& position) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto p = static_cast<float>(position[axis]);
            const float ulp =
                std::abs(p) * std::numeric_limits<float>::epsilon() + std::numeric_limits<float>::min();
            lower_[axis] = p - ulp;
            upper_[axis] = p + ulp;
        }
    }

    // Stores the squared distances to the children's boxes. Returns a mask of the children nearer than
    // sqrt(most).
    HWY_INLINE std::uint32_t near(const BoxTree::Node& node, double most, float* to_boxes) const {
        const D d;
        std::uint32_t bits = 0;
        const auto largest = hn::Set(d, std::numeric_limits<float>::max());
        // A box that contains the position is near even if `most` is below the range of float.
        const auto limit =
            hn::Set(d, std::max(static_cast<float>(most * 1.000001), std::numeric_limits<float>::min()));
        for (std::size_t c = 0; c < BoxTree::kWidth; c += hn::Lanes(d)) {
            auto sum = hn::Zero(d);
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const auto below = hn::Sub(hn::LoadU(d, node.lower[axis] + c), hn::Set(d, upper_[axis]));
                const auto above = hn::Sub(hn::Set(d, lower_[axis]), hn::LoadU(d, node.upper[axis] + c));
                const auto outside = hn::Max(hn::Max(below, above), hn::Zero(d));
                sum = hn::Add(sum, hn::Mul(outside, outside));
            }
            const auto least = hn::Min(hn::Mul(sum, hn::Set(d, 0.999998f)), largest);
            hn::Store(least, d, to_boxes + c);
            std::uint8_t mask[8] = {};
            hn::StoreMaskBits(d, hn::Lt(least, limit), mask);
            bits |= static_cast<std::uint32_t>(mask[0]) << c;
        }
        return bits & ((1u << node.count) - 1);
    }

  private:
    using D = hn::CappedTag<float, BoxTree::kWidth>;
    float lower_[3], upper_[3];
};

// Computes squared_distance_to_triangle, bit for bit, for the triangles of a leaf from index c on.
template <class D>
HWY_INLINE hn::Vec<D> squared_distances(D d, const Vec3d& position, const BoxTree::Leaf& leaf,
                                        std::size_t c) {
    using V = hn::Vec<D>;
    const auto dot = [](V ax, V ay, V az, V bx, V by, V bz) {
        return hn::Add(hn::Add(hn::Mul(ax, bx), hn::Mul(ay, by)), hn::Mul(az, bz));
    };
    const auto corner = [&](std::size_t which, std::size_t axis) {
        return hn::PromoteTo(d, hn::LoadU(hn::Rebind<float, D>(), leaf.corners[which][axis] + c));
    };
    const V ax = corner(0, 0), ay = corner(0, 1), az = corner(0, 2);
    const V ux = hn::Sub(corner(1, 0), ax), uy = hn::Sub(corner(1, 1), ay), uz = hn::Sub(corner(1, 2), az);
    const V vx = hn::Sub(corner(2, 0), ax), vy = hn::Sub(corner(2, 1), ay), vz = hn::Sub(corner(2, 2), az);
    const V fx = hn::Sub(hn::Set(d, position[0]), ax), fy = hn::Sub(hn::Set(d, position[1]), ay),
            fz = hn::Sub(hn::Set(d, position[2]), az);
    const V nx = hn::Sub(hn::Mul(uy, vz), hn::Mul(uz, vy)), ny = hn::Sub(hn::Mul(uz, vx), hn::Mul(ux, vz)),
            nz = hn::Sub(hn::Mul(ux, vy), hn::Mul(uy, vx));
    const V uu = dot(ux, uy, uz, ux, uy, uz), uv = dot(ux, uy, uz, vx, vy, vz),
            vv = dot(vx, vy, vz, vx, vy, vz), nn = dot(nx, ny, nz, nx, ny, nz);
    const V u_from = dot(ux, uy, uz, fx, fy, fz), v_from = dot(vx, vy, vz, fx, fy, fz);
    const V s = hn::Sub(hn::Mul(vv, u_from), hn::Mul(uv, v_from)),
            t = hn::Sub(hn::Mul(uu, v_from), hn::Mul(uv, u_from)), st = hn::Add(s, t);
    const V zero = hn::Zero(d), one = hn::Set(d, 1.0);
    const V height = dot(fx, fy, fz, nx, ny, nz);
    const V to_plane = hn::Div(hn::Mul(height, height), nn);
    // The nearest points on the edges.
    const auto fraction = [&](V part, V total) {
        return hn::IfThenElseZero(hn::Gt(total, zero), hn::Min(hn::Max(hn::Div(part, total), zero), one));
    };
    const auto squared = [&](V x, V y, V z) { return dot(x, y, z, x, y, z); };
    const V on_u = fraction(u_from, uu), on_v = fraction(v_from, vv);
    const V along_w = fraction(hn::Add(hn::Sub(v_from, u_from), hn::Sub(uu, uv)),
                               hn::Add(hn::Sub(uu, uv), hn::Sub(vv, uv)));
    const V along_u = hn::Sub(one, along_w);
    const auto away = [](V f, V p, V u) { return hn::Sub(f, hn::Mul(p, u)); };
    const V to_u = squared(away(fx, on_u, ux), away(fy, on_u, uy), away(fz, on_u, uz));
    const V to_v = squared(away(fx, on_v, vx), away(fy, on_v, vy), away(fz, on_v, vz));
    const V to_w = squared(away(away(fx, along_u, ux), along_w, vx), away(away(fy, along_u, uy), along_w, vy),
                           away(away(fz, along_u, uz), along_w, vz));
    const V far = hn::Set(d, std::numeric_limits<double>::infinity());
    const auto is_large = hn::Gt(nn, hn::Mul(hn::Set(d, kFlat), hn::Mul(uu, vv)));
    const auto not_u = hn::And(is_large, hn::Ge(t, zero)), not_v = hn::And(is_large, hn::Ge(s, zero)),
               not_w = hn::And(is_large, hn::Le(st, nn));
    const V to_edge = hn::Min(hn::Min(hn::IfThenElse(not_u, far, to_u), hn::IfThenElse(not_v, far, to_v)),
                              hn::IfThenElse(not_w, far, to_w));
    return hn::IfThenElse(hn::And(hn::And(not_u, not_v), not_w), to_plane, to_edge);
}

// Updates `found` if a triangle of the leaf is nearer. Returns whether one is.
HWY_INLINE bool search_leaf(const BoxTree::Leaf& leaf, const Vec3d& position, FoundTriangle& found) {
    const hn::CappedTag<double, BoxTree::kWidth> d;
    const double before = found.squared_distance;
    for (std::size_t c = 0; c < BoxTree::kWidth; c += hn::Lanes(d)) {
        const auto squared = squared_distances(d, position, leaf, c);
        const auto nearer = hn::Lt(squared, hn::Set(d, found.squared_distance));
        if (hn::AllFalse(d, nearer)) continue;
        const auto far = hn::Set(d, std::numeric_limits<double>::infinity());
        const auto least = hn::MinOfLanes(d, hn::IfThenElse(nearer, squared, far));
        const auto lane = static_cast<std::size_t>(hn::FindFirstTrue(d, hn::Eq(squared, least)));
        found = {hn::GetLane(least), leaf.triangle[c + lane]};
    }
    return found.squared_distance < before;
}

// A child that a search may still visit: the squared distance to its box in the upper half,
// BoxTree::Node::child in the lower half. Choosing between two single numbers needs no branch, which would
// often be mispredicted.
using Pending = std::uint64_t;

FoundTriangle find_nearest_any(const BoxTree& tree, const Vec3d& position, double enough, double most,
                               std::uint32_t* guess) {
    Pending stack[BoxTree::kMaxPending];
    alignas(64) float to_boxes[BoxTree::kWidth];
    const Query query(position);
    constexpr double kFar = std::numeric_limits<double>::infinity();
    // A triangle at exactly the distance `most` counts.
    FoundTriangle found{most < kFar ? std::nextafter(most * most, kFar) : kFar, 0};
    const std::uint32_t guessed = guess ? *guess : BoxTree::kLeaf;
    if (guess) search_leaf(tree.leaves[*guess], position, found);
    constexpr Pending kRoot = 0, kNone = ~Pending{0};
    std::size_t depth = 0;
    stack[depth++] = kRoot;
    while (depth > 0 && found.squared_distance > enough * enough) {
        Pending at = stack[--depth];
        if (!(std::bit_cast<float>(static_cast<std::uint32_t>(at >> 32)) < found.squared_distance)) continue;
        // Descends to a leaf, always to the nearest child.
        while ((at & BoxTree::kLeaf) == 0) {
            const BoxTree::Node& node = tree.nodes[static_cast<std::uint32_t>(at)];
            at = kNone;
            for (std::uint32_t bits = query.near(node, found.squared_distance, to_boxes); bits != 0;
                 bits &= bits - 1) {
                const auto child = static_cast<std::uint32_t>(hwy::Num0BitsBelowLS1Bit_Nonzero32(bits));
                const Pending next =
                    Pending{std::bit_cast<std::uint32_t>(to_boxes[child])} << 32 | node.child[child];
                const bool is_nearer = next >> 32 <= at >> 32;
                stack[depth] = is_nearer ? at : next;
                depth += stack[depth] != kNone ? 1 : 0;
                at = is_nearer ? next : at;
            }
        }
        const std::uint32_t leaf = static_cast<std::uint32_t>(at) ^ BoxTree::kLeaf;
        if (at == kNone || leaf == guessed) continue;
        if (search_leaf(tree.leaves[leaf], position, found) && guess) *guess = leaf;
    }
    return found;
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(find_nearest_any);

FoundTriangle find_nearest(const BoxTree& tree, const Vec3d& position, double enough, double most,
                           std::uint32_t* guess) {
    return HWY_DYNAMIC_DISPATCH(find_nearest_any)(tree, position, enough, most, guess);
}

}  // namespace marrow::internal
#endif
