/// Keeping a surface near another while it is changed piece by piece.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <marrow/mesh.h>

#include "triangle_tree.h"

namespace marrow::internal {

/// A triangle of the changing surface, and where its corners are.
struct PlacedTriangle {
    std::uint32_t index;
    Vec3d a, b, c;
};

/// Lets triangles be replaced only where every point of the surface at first stays within a distance of the
/// changed one, and the new triangles' places within that of the surface at first. After Klein, Liebich and
/// Strasser 1996: each of the first points belongs to a triangle near it, so that a change asks few of them.
class DeviationGuard {
  public:
    /// The tree is that of the mesh, and both must outlive the guard. \pre fewer than 2^32 triangles
    DeviationGuard(const Mesh& mesh, const TriangleTree& tree, double max_distance);

    /// Whether the triangles `gone` may go and those of `patch`, which share corner a, be where they are now; if
    /// so, takes note.
    bool accept(std::span<const std::uint32_t> gone, std::span<const PlacedTriangle> patch);

    /// The points at first that belong to a triangle now.
    template <class F>
    void for_each_point_of(std::uint32_t triangle, F f) const {
        for (std::uint32_t p = first_point_[triangle]; p != kNone; p = next_point_[p]) f(p);
    }

  private:
    static constexpr std::uint32_t kNone = ~std::uint32_t{0};
    bool points_stay_near(std::span<const PlacedTriangle> patch);
    bool patch_is_near(std::span<const PlacedTriangle> patch) const;
    bool is_near(const Vec3d& place) const;

    const Mesh& mesh_;
    const TriangleTree& tree_;
    const double max_distance_;
    std::vector<Vec3d> points_;
    std::vector<std::uint32_t> first_point_;  // of each triangle: a list of the points that belong to it
    std::vector<std::uint32_t> next_point_;
    std::vector<std::size_t> fan_begin_;  // of each point at first: where its triangles begin in fans_
    std::vector<std::uint32_t> fans_;
    struct Move {
        std::uint32_t point, triangle;
    };
    std::vector<Move> moves_;  // kept for its memory
};

}  // namespace marrow::internal
