/// Finding triangles of a mesh by place: the nearest, those along a ray, those in a box.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <marrow/mesh.h>
#include <marrow/volume.h>

#include "morton_curve.h"
#include "triangle_search.h"

namespace marrow::internal {

/// A copy of a mesh's triangles along a Morton curve, and a tree of boxes over them, eight under each, that are parted
/// where the curve goes from one half of a cube to the other: little more work than sorting them. After Lauterbach et al.
/// 2009.
class TriangleTree {
  public:
    /// \pre mesh has triangles, fewer than 2^32, and they name points that are there
    explicit TriangleTree(const Mesh& mesh);

    /// The i-th triangle of the mesh along the curve, on which neighbours lie near each other.
    std::uint32_t along_curve(std::size_t i) const { return order_[i].triangle; }

    /// Where a search begins that is given no better guess.
    static constexpr std::uint32_t kAnywhere = 0;

    /// The distance from a place to the nearest one on a triangle; or to any that is no further than `enough`.
    double distance(const Vec3d& place, double enough = 0) const { return nearest(place, enough).distance; }
    /// The same, with a guess where to look first, which becomes where it was found: that of a place near by makes
    /// it faster and changes nothing.
    double distance(const Vec3d& place, double enough, std::uint32_t& guess) const {
        return std::sqrt(find_nearest(tree_, place, enough, kFar, &guess).squared_distance);
    }

    struct Nearest {
        double distance;
        std::uint32_t triangle;  ///< of the mesh
    };
    /// The nearest triangle; or the first found that is no further than `enough`.
    Nearest nearest(const Vec3d& place, double enough = 0) const {
        const FoundTriangle found = find_nearest(tree_, place, enough, kFar, nullptr);
        return {std::sqrt(found.squared_distance), found.triangle};
    }

    /// Whether a triangle is no further than `distance`; faster than to ask for the nearest.
    bool is_within(const Vec3d& place, double distance) const {
        return find_nearest(tree_, place, distance, distance, nullptr).squared_distance <=
               distance * distance;
    }

    /// Calls f(t, triangle) for each triangle of the mesh that the ray from `origin` meets at
    /// origin + t * direction, 0 <= t <= t_max, in no order. Triangles along the ray are not met.
    template <class F>
    void for_each_hit(const Vec3d& origin, const Vec3d& direction, double t_max, F f) const;

    struct Box {
        Vec3f lower, upper;
    };
    static Box box_of(const Triangle& t, const Mesh& mesh) {
        return box_of(mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]]);
    }
    /// Calls f(triangle) for each triangle of the mesh whose box shares a place with `box`, in no order.
    template <class F>
    void for_each_in(const Box& box, F f) const;

  private:
    static constexpr double kFar = std::numeric_limits<double>::infinity();

    static Box box_of(const Vec3f& a, const Vec3f& b, const Vec3f& c);
    static Box box_of(const BoxTree::Leaf& leaf);
    static Box box_of(const BoxTree::Leaf& leaf, std::size_t i) {
        return box_of(leaf.corner(0, i), leaf.corner(1, i), leaf.corner(2, i));
    }
    static Box box_of(const BoxTree::Node& node, std::size_t i) {
        return {{node.lower[0][i], node.lower[1][i], node.lower[2][i]},
                {node.upper[0][i], node.upper[1][i], node.upper[2][i]}};
    }
    /// Calls f(leaf, i) for the triangles whose boxes are `wanted`.
    template <class Wanted, class F>
    void visit(Wanted wanted, F f) const;
    /// Triangles that follow each other along the curve.
    struct Range {
        std::uint32_t begin, end;

        std::uint32_t size() const { return end - begin; }
    };
    std::uint32_t middle_of(const Range& range) const;
    void part(std::uint32_t node, const Range& range, std::vector<Range>& leaves);
    void fill(BoxTree::Leaf& leaf, const Range& range, const Mesh& mesh) const;
    void find_boxes();
    static double hit(const BoxTree::Leaf& leaf, std::size_t i, const Vec3d& origin, const Vec3d& direction);

    std::vector<OnCurve> order_;
    BoxTree tree_;
};

template <class Wanted, class F>
void TriangleTree::visit(Wanted wanted, F f) const {
    std::array<std::uint32_t, BoxTree::kMostSeen> stack;
    std::size_t depth = 0;
    stack[depth++] = 0;
    while (depth > 0) {
        const std::uint32_t at = stack[--depth];
        if ((at & BoxTree::kLeaf) != 0) {
            const BoxTree::Leaf& leaf = tree_.leaves[at ^ BoxTree::kLeaf];
            for (std::size_t i = 0; i < leaf.count; ++i) {
                if (wanted(box_of(leaf, i))) f(leaf, i);
            }
            continue;
        }
        const BoxTree::Node& node = tree_.nodes[at];
        for (std::size_t i = 0; i < node.count; ++i) {
            if (wanted(box_of(node, i))) stack[depth++] = node.under[i];
        }
    }
}

template <class F>
void TriangleTree::for_each_hit(const Vec3d& origin, const Vec3d& direction, double t_max, F f) const {
    visit(
        [&](const Box& box) {
            double enter = 0, leave = t_max;
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const double lower = box.lower[axis] - origin[axis], upper = box.upper[axis] - origin[axis];
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
void TriangleTree::for_each_in(const Box& box, F f) const {
    const auto overlaps = [&](const Box& other) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            if (other.lower[axis] > box.upper[axis] || other.upper[axis] < box.lower[axis]) return false;
        }
        return true;
    };
    visit(overlaps, [&](const BoxTree::Leaf& leaf, std::size_t i) { f(leaf.triangle[i]); });
}

}  // namespace marrow::internal
