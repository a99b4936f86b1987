// Finds the nearest triangle of a tree. Highway compiles this file once for each SIMD target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "mesh/search/triangle_search.cpp"
#include <hwy/cache_control.h>
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <span>

#include "mesh/geometry/vectors-inl.h"
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

// Triangles of a leaf, from index c on, with what their distance from a position depends on but the position.
template <class D>
class LeafTriangles {
  public:
    using V = hn::Vec<D>;

    HWY_INLINE LeafTriangles(D d, const BoxTree::Leaf& leaf, std::size_t c)
        : a_(corners(leaf, 0, c)),
          u_(corners(leaf, 1, c) - a_),
          v_(corners(leaf, 2, c) - a_),
          w_(v_ - u_),
          n_(cross(u_, v_)),
          uu_(dot(u_, u_)),
          uv_(dot(u_, v_)),
          vv_(dot(v_, v_)),
          nn_(dot(n_, n_)),
          u_to_w_(hn::Sub(uu_, uv_)) {
        per_uu_ = inverse(uu_);
        per_vv_ = inverse(vv_);
        per_ww_ = inverse(hn::Add(u_to_w_, hn::Sub(vv_, uv_)));
        per_nn_ = hn::Div(hn::Set(d, 1.0), nn_);
        // No position is within the edges of a triangle that is flat: s + t <= nn is then false.
        const auto is_large = hn::Gt(nn_, hn::Mul(hn::Set(d, kFlat), hn::Mul(uu_, vv_)));
        is_flat_ = hn::Not(is_large);
    }

    // Computes squared_distance_to_triangle, bit for bit.
    HWY_INLINE V squared_distances(const Vec3d& position) const {
        const D d;
        const Vectors<D> from = everywhere(d, position) - a_;
        const V u_from = dot(u_, from), v_from = dot(v_, from), height = dot(from, n_);
        const V s = hn::Sub(hn::Mul(vv_, u_from), hn::Mul(uv_, v_from)),
                t = hn::Sub(hn::Mul(uu_, v_from), hn::Mul(uv_, u_from));
        const V to_plane = hn::Mul(hn::Mul(height, height), per_nn_);
        const V to_u = to_edge(from, u_, hn::Mul(u_from, per_uu_)),
                to_v = to_edge(from, v_, hn::Mul(v_from, per_vv_)),
                to_w = to_edge(from - u_, w_, hn::Mul(hn::Add(hn::Sub(v_from, u_from), u_to_w_), per_ww_));
        const V zero = hn::Zero(d), far = hn::Set(d, std::numeric_limits<double>::infinity());
        const auto beyond_u = hn::Or(is_flat_, hn::Lt(t, zero)), beyond_v = hn::Or(is_flat_, hn::Lt(s, zero)),
                   beyond_w = hn::Or(is_flat_, hn::Gt(hn::Add(s, t), nn_));
        const V to_edges =
            hn::Min(hn::Min(hn::IfThenElse(beyond_u, to_u, far), hn::IfThenElse(beyond_v, to_v, far)),
                    hn::IfThenElse(beyond_w, to_w, far));
        return hn::IfThenElse(hn::Or(hn::Or(beyond_u, beyond_v), beyond_w), to_edges, to_plane);
    }

  private:
    static HWY_INLINE Vectors<D> corners(const BoxTree::Leaf& leaf, std::size_t which, std::size_t c) {
        const auto along = [&](std::size_t axis) HWY_ATTR {
            return hn::PromoteTo(D(), hn::LoadU(hn::Rebind<float, D>(), leaf.corners[which][axis] + c));
        };
        return {along(0), along(1), along(2)};
    }
    static HWY_INLINE V inverse(V total) {
        const D d;
        return hn::IfThenElseZero(hn::Gt(total, hn::Zero(d)), hn::Div(hn::Set(d, 1.0), total));
    }
    static HWY_INLINE V to_edge(const Vectors<D>& from, const Vectors<D>& edge, V along) {
        const D d;
        const Vectors<D> off = from - hn::Min(hn::Max(along, hn::Zero(d)), hn::Set(d, 1.0)) * edge;
        return dot(off, off);
    }

    const Vectors<D> a_, u_, v_, w_, n_;
    const V uu_, uv_, vv_, nn_, u_to_w_;
    V per_uu_, per_vv_, per_ww_, per_nn_;
    hn::Mask<D> is_flat_;
};

// Updates `found` if a triangle of the leaf is nearer.
HWY_INLINE void search_leaf(const BoxTree::Leaf& leaf, const Vec3d& position, FoundTriangle& found) {
    const hn::CappedTag<double, BoxTree::kWidth> d;
    for (std::size_t c = 0; c < BoxTree::kWidth; c += hn::Lanes(d)) {
        const auto squared = LeafTriangles(d, leaf, c).squared_distances(position);
        const auto nearer = hn::Lt(squared, hn::Set(d, found.squared_distance));
        if (hn::AllFalse(d, nearer)) continue;
        const auto far = hn::Set(d, std::numeric_limits<double>::infinity());
        const auto least = hn::MinOfLanes(d, hn::IfThenElse(nearer, squared, far));
        const auto lane = static_cast<std::size_t>(hn::FindFirstTrue(d, hn::Eq(squared, least)));
        found = {hn::GetLane(least), leaf.triangle[c + lane]};
    }
}

// A child that a search may still visit: the squared distance to its box in the upper half,
// BoxTree::Node::child in the lower half. Choosing between two single numbers needs no branch, which would
// often be mispredicted.
using Pending = std::uint64_t;

// A triangle at exactly the distance `most` is nearer than this.
FoundTriangle nothing_within(double most) {
    constexpr double kFar = std::numeric_limits<double>::infinity();
    return {most < kFar ? std::nextafter(most * most, kFar) : kFar, 0};
}

// Searches for a triangle that is nearer than `found`.
FoundTriangle find_nearer(const BoxTree& tree, const Vec3d& position, double enough, FoundTriangle found) {
    Pending stack[BoxTree::kMaxPending];
    alignas(64) float to_boxes[BoxTree::kWidth];
    const Query query(position);
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
        if (at == kNone) continue;
        search_leaf(tree.leaves[static_cast<std::uint32_t>(at) ^ BoxTree::kLeaf], position, found);
    }
    return found;
}

// A box around positions, with a margin. Rounding to float only makes it larger.
class Surroundings {
  public:
    Surroundings(std::span<const NearestQuery> queries, double margin) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            double lower = queries.front().position[axis], upper = lower;
            for (const NearestQuery& query : queries) {
                lower = std::min(lower, query.position[axis]);
                upper = std::max(upper, query.position[axis]);
            }
            lower_[axis] = outwards(lower - margin, -1);
            upper_[axis] = outwards(upper + margin, 1);
        }
    }

    // Returns a mask of the children whose boxes overlap or touch this one.
    HWY_INLINE std::uint32_t overlapping(const BoxTree::Node& node) const {
        const hn::CappedTag<float, BoxTree::kWidth> d;
        std::uint32_t bits = 0;
        for (std::size_t c = 0; c < BoxTree::kWidth; c += hn::Lanes(d)) {
            auto overlaps = hn::FirstN(d, hn::Lanes(d));
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const auto below = hn::Le(hn::LoadU(d, node.lower[axis] + c), hn::Set(d, upper_[axis])),
                           above = hn::Ge(hn::LoadU(d, node.upper[axis] + c), hn::Set(d, lower_[axis]));
                overlaps = hn::And(overlaps, hn::And(below, above));
            }
            std::uint8_t mask[8] = {};
            hn::StoreMaskBits(d, overlaps, mask);
            bits |= static_cast<std::uint32_t>(mask[0]) << c;
        }
        return bits & ((1u << node.count) - 1);
    }

  private:
    static float outwards(double x, double sign) {
        const double ulps = std::abs(x) * std::numeric_limits<float>::epsilon();
        return static_cast<float>(x + sign * (ulps + std::numeric_limits<float>::min()));
    }
    float lower_[3], upper_[3];
};

// A leaf near the positions of a group.
struct NearLeaf {
    float lower[3], upper[3];
    std::uint32_t leaf;
};

// Lists leaves that overlap the surroundings, and fetches them, as they may be anywhere in memory. Returns
// their number, or kMost if there are more than that.
template <std::size_t kMost>
HWY_INLINE std::size_t list_leaves(const BoxTree& tree, const Surroundings& surroundings,
                                   NearLeaf (&list)[kMost]) {
    std::uint32_t stack[BoxTree::kMaxPending];
    std::size_t depth = 0, count = 0;
    stack[depth++] = 0;
    while (depth > 0) {
        const BoxTree::Node& node = tree.nodes[stack[--depth]];
        for (std::uint32_t bits = surroundings.overlapping(node); bits != 0; bits &= bits - 1) {
            const auto child = static_cast<std::uint32_t>(hwy::Num0BitsBelowLS1Bit_Nonzero32(bits));
            if ((node.child[child] & BoxTree::kLeaf) == 0) {
                stack[depth++] = node.child[child];
                continue;
            }
            NearLeaf& near = list[count];
            for (std::size_t axis = 0; axis < 3; ++axis) {
                near.lower[axis] = node.lower[axis][child];
                near.upper[axis] = node.upper[axis][child];
            }
            near.leaf = node.child[child] ^ BoxTree::kLeaf;
            for (const auto& corner : tree.leaves[near.leaf].corners) {
                hwy::Prefetch(&corner[0]);
                hwy::Prefetch(&corner[2]);
            }
            if (++count == kMost) return count;
        }
    }
    return count;
}

// Searches a group of positions leaf by leaf.
class GroupSearch {
  public:
    explicit GroupSearch(std::span<NearestQuery> queries) : queries_(queries) {
        for (std::size_t q = 0; q < kGroup; ++q) {
            const Vec3d& position = queries[std::min(q, queries.size() - 1)].position;
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const auto p = static_cast<float>(position[axis]);
                const float ulp =
                    std::abs(p) * std::numeric_limits<float>::epsilon() + std::numeric_limits<float>::min();
                lower_[axis][q] = p - ulp;
                upper_[axis][q] = p + ulp;
            }
        }
    }

    HWY_INLINE void search(const BoxTree& tree, std::span<const NearLeaf> leaves) {
        find_first(leaves);
        for (std::size_t l = 0; l < leaves.size(); ++l)
            search_leaf(tree.leaves[leaves[l].leaf], has_first(l));
        for (std::size_t l = 0; l < leaves.size(); ++l)
            search_leaf(tree.leaves[leaves[l].leaf], near(leaves[l]) & ~has_first(l));
    }

  private:
    static constexpr std::size_t kGroup = kMostInGroup;
    using D = hn::CappedTag<float, kGroup>;

    // A bit for each position that mask(first lane) sets.
    template <class Mask>
    HWY_INLINE std::uint32_t positions_where(const Mask& mask) const {
        const D d;
        std::uint32_t bits = 0;
        for (std::size_t q = 0; q < kGroup; q += hn::Lanes(d)) {
            std::uint8_t part[8] = {};
            hn::StoreMaskBits(d, mask(q), part);
            bits |= (part[0] | static_cast<std::uint32_t>(part[1]) << 8) << q;
        }
        return bits & ((1u << queries_.size()) - 1);
    }

    // Finds the leaf whose middle is nearest to each position: often it has the nearest triangle.
    HWY_INLINE void find_first(std::span<const NearLeaf> leaves) {
        const D d;
        const hn::RebindToUnsigned<D> du;
        for (std::size_t q = 0; q < kGroup; q += hn::Lanes(d)) {
            auto least = hn::Set(d, std::numeric_limits<float>::infinity());
            auto first = hn::Zero(du);
            for (std::uint32_t l = 0; l < leaves.size(); ++l) {
                auto sum = hn::Zero(d);
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    const float middle = 0.5f * (leaves[l].lower[axis] + leaves[l].upper[axis]);
                    const auto off = hn::Sub(hn::Load(d, lower_[axis] + q), hn::Set(d, middle));
                    sum = hn::Add(sum, hn::Mul(off, off));
                }
                first = hn::IfThenElse(hn::RebindMask(du, hn::Lt(sum, least)), hn::Set(du, l), first);
                least = hn::Min(least, sum);
            }
            hn::Store(first, du, first_ + q);
        }
    }

    // Returns a mask of the positions whose first leaf this is.
    HWY_INLINE std::uint32_t has_first(std::size_t leaf) const {
        const hn::RebindToUnsigned<D> du;
        const auto number = hn::Set(du, static_cast<std::uint32_t>(leaf));
        return positions_where([&](std::size_t q) HWY_ATTR {
            return hn::RebindMask(D(), hn::Eq(hn::Load(du, first_ + q), number));
        });
    }

    // Updates the positions of a mask.
    HWY_INLINE void search_leaf(const BoxTree::Leaf& leaf, std::uint32_t positions) {
        if (positions == 0) return;
        const hn::CappedTag<double, BoxTree::kWidth> d;
        for (std::size_t c = 0; c < BoxTree::kWidth; c += hn::Lanes(d)) {
            const LeafTriangles triangles(d, leaf, c);
            for (std::uint32_t bits = positions; bits != 0; bits &= bits - 1) {
                const auto q = static_cast<std::uint32_t>(hwy::Num0BitsBelowLS1Bit_Nonzero32(bits));
                const auto squared = triangles.squared_distances(queries_[q].position);
                queries_[q].squared_distance =
                    std::min(queries_[q].squared_distance, hn::GetLane(hn::MinOfLanes(d, squared)));
            }
        }
        for (std::uint32_t bits = positions; bits != 0; bits &= bits - 1)
            limit(static_cast<std::uint32_t>(hwy::Num0BitsBelowLS1Bit_Nonzero32(bits)));
    }

    // Only triangles nearer than what was found are of interest, and none if that is enough.
    HWY_INLINE void limit(std::size_t q) {
        const NearestQuery& query = queries_[q];
        const double squared = query.squared_distance;
        const bool done = squared <= query.enough * query.enough;
        // A box that contains the position is near even if `squared` is below the range of float.
        limit_[q] =
            done ? -1 : std::max(static_cast<float>(squared * 1.000003), std::numeric_limits<float>::min());
    }

    // Returns a mask of the positions to which the box of a leaf is near enough.
    HWY_INLINE std::uint32_t near(const NearLeaf& leaf) const {
        const D d;
        return positions_where([&](std::size_t q) HWY_ATTR {
            auto sum = hn::Zero(d);
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const auto below = hn::Sub(hn::Set(d, leaf.lower[axis]), hn::Load(d, upper_[axis] + q));
                const auto above = hn::Sub(hn::Load(d, lower_[axis] + q), hn::Set(d, leaf.upper[axis]));
                const auto outside = hn::Max(hn::Max(below, above), hn::Zero(d));
                sum = hn::Add(sum, hn::Mul(outside, outside));
            }
            const auto least = hn::Min(sum, hn::Set(d, std::numeric_limits<float>::max()));
            return hn::Lt(least, hn::Load(d, limit_ + q));
        });
    }

    std::span<NearestQuery> queries_;
    alignas(64) float lower_[3][kGroup], upper_[3][kGroup];
    alignas(64) float limit_[kGroup] = {};
    alignas(64) std::uint32_t first_[kGroup];
};

void find_nearest_of_group(const BoxTree& tree, std::span<NearestQuery> queries, double reach) {
    constexpr std::size_t kMostLeaves = 128;
    NearLeaf list[kMostLeaves];
    const std::size_t count = list_leaves(tree, Surroundings(queries, reach), list);
    for (NearestQuery& query : queries) query.squared_distance = std::numeric_limits<double>::infinity();
    if (count > 0) GroupSearch(queries).search(tree, {list, count});
    // What is not listed is further away than `reach`.
    const double listed = count < kMostLeaves ? 0.999999 * reach * reach : -1;
    for (NearestQuery& query : queries) {
        const double squared = query.squared_distance;
        if (squared <= std::max(listed, query.enough * query.enough)) continue;
        query.squared_distance =
            find_nearer(tree, query.position, query.enough, {squared, 0}).squared_distance;
    }
}

FoundTriangle find_nearest_any(const BoxTree& tree, const Vec3d& position, double enough, double most) {
    return find_nearer(tree, position, enough, nothing_within(most));
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(find_nearest_any);
HWY_EXPORT(find_nearest_of_group);

FoundTriangle find_nearest(const BoxTree& tree, const Vec3d& position, double enough, double most) {
    return HWY_DYNAMIC_DISPATCH(find_nearest_any)(tree, position, enough, most);
}

void find_nearest(const BoxTree& tree, std::span<NearestQuery> queries, double reach) {
    HWY_DYNAMIC_DISPATCH(find_nearest_of_group)(tree, queries, reach);
}

}  // namespace marrow::internal
#endif
