/// Finds triangles of a mesh by position: the nearest one, all along a ray, or all in a box.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <marrow/buffer.h>
#include <marrow/mesh.h>

#include "mesh/geometry/bounds.h"
#include "morton_curve.h"
#include "triangle_search.h"

namespace marrow::internal {

inline Bounds bounds_of(const Vec3f& a, const Vec3f& b, const Vec3f& c) {
    Bounds bounds;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        bounds.lower[axis] = std::min({a[axis], b[axis], c[axis]});
        bounds.upper[axis] = std::max({a[axis], b[axis], c[axis]});
    }
    return bounds;
}
inline Bounds bounds_of(const MeshView& mesh, const Triangle& t) {
    return bounds_of(mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]]);
}

/// Copies the triangles of a mesh in the order of a Morton curve, and builds a bounding volume hierarchy over
/// them. Its nodes split where the curve changes from one half of a cube to the other, so it costs little
/// more than sorting. After Lauterbach et al. 2009.
class TriangleTree {
  public:
    /// \pre the mesh has triangles, fewer than 2^32, and their indices are in range
    explicit TriangleTree(const MeshView& mesh);

    /// All triangles, in leaves that are near each other if they follow each other.
    std::span<const BoxTree::Leaf> leaves() const { return tree_.leaves; }

    /// The distance from a position to the nearest triangle, or to any triangle within the distance `enough`.
    double distance(const Vec3d& position, double enough = 0) const {
        return nearest(position, enough).distance;
    }

    struct Nearest {
        double distance;
        std::uint32_t triangle;  ///< the index in the mesh
    };
    /// The nearest triangle, or any triangle within the distance `enough`.
    Nearest nearest(const Vec3d& position, double enough = 0) const {
        const FoundTriangle found = internal::find_nearest(tree_, position, enough, kInfinity);
        return {std::sqrt(found.squared_distance), found.triangle};
    }

    /// Whether a triangle is within `distance` of a position. Faster than finding the nearest triangle.
    bool is_within(const Vec3d& position, double distance) const {
        return internal::find_nearest(tree_, position, distance, distance).squared_distance <=
               distance * distance;
    }

    /// Sets the squared distances of positions that are near each other; see triangle_search.h.
    void find_nearest(std::span<NearestQuery> queries, double reach) const {
        internal::find_nearest(tree_, queries, reach);
    }

    /// Calls f(t, triangle) for each triangle that the ray from `origin` hits at origin + t * direction with
    /// 0 <= t <= t_max, in no particular order. A triangle that is parallel to the ray is not hit.
    template <class F>
    void for_each_hit(const Vec3d& origin, const Vec3d& direction, double t_max, F f) const;

    /// Calls f(triangle) for each triangle whose bounds overlap or touch the given bounds, in no particular
    /// order.
    template <class F>
    void for_each_in(const Bounds& bounds, F f) const;

  private:
    static constexpr double kInfinity = std::numeric_limits<double>::infinity();

    /// Calls f(leaf, i) for the triangles whose bounds are `wanted`.
    template <class Wanted, class F>
    void visit(Wanted wanted, F f) const;
    /// Successive triangles along the curve.
    struct Range {
        std::uint32_t begin, end;

        std::uint32_t size() const { return end - begin; }
    };
    /// What the nodes will be, without their boxes: a sixth of the memory, as it grows.
    struct Splits {
        struct Node {
            std::array<std::uint32_t, BoxTree::kWidth> child;  ///< as in BoxTree::Node
            std::uint32_t count;
        };
        std::vector<Node> nodes;
        std::vector<Range> leaves;
    };
    std::uint32_t split_position(const Range& range) const;
    void split(std::size_t node, const Range& range, Splits& splits) const;
    std::uint32_t along_curve(std::size_t i) const { return order_[i].triangle; }
    void fill(BoxTree::Leaf& leaf, const Range& range, const MeshView& mesh) const;
    void merge_bounds();
    static double hit(const BoxTree::Leaf& leaf, std::size_t i, const Vec3d& origin, const Vec3d& direction);

    Buffer<MortonKey> order_;
    BoxTree tree_;
};

template <class Wanted, class F>
void TriangleTree::visit(Wanted wanted, F f) const {
    std::array<std::uint32_t, BoxTree::kMaxPending> stack;
    std::size_t depth = 0;
    stack[depth++] = 0;
    while (depth > 0) {
        const std::uint32_t at = stack[--depth];
        if ((at & BoxTree::kLeaf) != 0) {
            const BoxTree::Leaf& leaf = tree_.leaves[at ^ BoxTree::kLeaf];
            for (std::size_t i = 0; i < leaf.count; ++i) {
                if (wanted(bounds_of(leaf.corner(0, i), leaf.corner(1, i), leaf.corner(2, i)))) f(leaf, i);
            }
            continue;
        }
        const BoxTree::Node& node = tree_.nodes[at];
        for (std::size_t i = 0; i < node.count; ++i) {
            const Bounds bounds{{node.lower[0][i], node.lower[1][i], node.lower[2][i]},
                                {node.upper[0][i], node.upper[1][i], node.upper[2][i]}};
            if (wanted(bounds)) stack[depth++] = node.child[i];
        }
    }
}

template <class F>
void TriangleTree::for_each_hit(const Vec3d& origin, const Vec3d& direction, double t_max, F f) const {
    visit(
        [&](const Bounds& bounds) {
            double enter = 0, leave = t_max;
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const double lower = bounds.lower[axis] - origin[axis],
                             upper = bounds.upper[axis] - origin[axis];
                if (direction[axis] == 0) {
                    if (lower > 0 || upper < 0) return false;
                    continue;
                }
                const double to_lower = lower / direction[axis], to_upper = upper / direction[axis];
                enter = std::max(enter, std::min(to_lower, to_upper));
                leave = std::min(leave, std::max(to_lower, to_upper));
            }
            return enter <= leave;
        },
        [&](const BoxTree::Leaf& leaf, std::size_t i) {
            const double at = hit(leaf, i, origin, direction);
            if (at >= 0 && at <= t_max) f(at, leaf.triangle[i]);
        });
}

template <class F>
void TriangleTree::for_each_in(const Bounds& bounds, F f) const {
    visit([&](const Bounds& other) { return bounds.overlaps(other); },
          [&](const BoxTree::Leaf& leaf, std::size_t i) { f(leaf.triangle[i]); });
}

}  // namespace marrow::internal
