/// Finding triangles of a mesh by place: the nearest, those along a ray, those in a box.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <marrow/mesh.h>
#include <marrow/volume.h>

namespace marrow::internal {

/// A copy of a mesh's triangles under a balanced binary tree of boxes, parted at the median of the longest
/// axis.
class TriangleTree {
  public:
    /// \pre mesh has triangles, and they name points that are there
    explicit TriangleTree(const Mesh& mesh);

    /// The distance from a place to the nearest one on a triangle; or to any that is no further than `enough`.
    double distance(const Vec3d& place, double enough = 0) const { return nearest(place, enough).distance; }
    /// The same, with a guess where to look first, which becomes where it was found: that of a place near by makes
    /// it faster and changes nothing.
    double distance(const Vec3d& place, std::size_t& leaf) const { return nearest(place, 0, &leaf).distance; }

    struct Nearest {
        double distance;
        std::uint32_t triangle;  ///< of the mesh
    };
    /// The nearest triangle; or the first found that is no further than `enough`.
    Nearest nearest(const Vec3d& place, double enough = 0) const { return nearest(place, enough, nullptr); }

    /// Whether a triangle is no further than `distance`; faster than to ask for the nearest.
    bool is_within(const Vec3d& place, double distance) const;

    /// Calls f(t, triangle) for each triangle of the mesh that the ray from `origin` meets at
    /// origin + t * direction, 0 <= t <= t_max, in no order. Triangles along the ray are not met.
    template <class F>
    void for_each_hit(const Vec3d& origin, const Vec3d& direction, double t_max, F f) const;

    struct Box {
        Vec3f lower, upper;
    };
    static Box box_of(const Triangle& t, const Mesh& mesh) {
        return Corners{mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]], 0}.box();
    }
    /// Calls f(triangle) for each triangle of the mesh whose box shares a place with `box`, in no order.
    template <class F>
    void for_each_in(const Box& box, F f) const;

  private:
    struct Corners {
        Vec3f a, b, c;
        std::uint32_t triangle;

        Box box() const;
    };
    /// Calls f for the triangles in the leaves under the nodes whose boxes are `wanted`.
    template <class Wanted, class F>
    void visit(Wanted wanted, F f) const;
    Nearest nearest(const Vec3d& place, double enough, std::size_t* leaf) const;
    static double hit(const Corners& t, const Vec3d& origin, const Vec3d& direction);
    void part(std::size_t node, std::size_t first, std::size_t size);
    void approach_leaf(std::size_t leaf, const Vec3d& place, Nearest& squared) const;

    static constexpr std::size_t kLeafSize = 4;

    std::vector<Corners> triangles_;  ///< in the order of the leaves, kLeafSize each
    std::size_t leaves_;              ///< a power of two; the last ones may be empty
    std::vector<Box> boxes_;          ///< node 1 is the root, those below n are 2 n and 2 n + 1
};

template <class Wanted, class F>
void TriangleTree::visit(Wanted wanted, F f) const {
    std::array<std::size_t, 64> stack;
    std::size_t depth = 0;
    stack[depth++] = 1;
    while (depth > 0) {
        const std::size_t node = stack[--depth];
        if (!wanted(boxes_[node])) continue;
        if (node < leaves_) {
            stack[depth++] = 2 * node + 1;
            stack[depth++] = 2 * node;
            continue;
        }
        const std::size_t begin = (node - leaves_) * kLeafSize;
        const std::size_t end = std::min(begin + kLeafSize, triangles_.size());
        for (std::size_t i = begin; i < end; ++i) f(triangles_[i]);
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
        [&](const Corners& t) {
            const double at = hit(t, origin, direction);
            if (at >= 0 && at <= t_max) f(at, t.triangle);
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
    visit(overlaps, [&](const Corners& t) {
        if (overlaps(t.box())) f(t.triangle);
    });
}

}  // namespace marrow::internal
