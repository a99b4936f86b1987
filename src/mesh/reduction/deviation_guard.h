/// Keeps a surface near its original while its triangles are replaced.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <marrow/buffer.h>
#include <marrow/mesh.h>

#include "base/parallel.h"
#include "collapse_guard.h"
#include "mesh/search/triangle_tree.h"

namespace marrow::internal {

/// Accepts a change only if all original points stay near the changed surface, and samples of the new
/// triangles are near the original surface. After Klein, Liebich and Strasser 1996: each original point is
/// assigned to a triangle near it, so that a change concerns only the points of the triangles that it
/// replaces.
class DeviationGuard : public CollapseGuard {
  public:
    /// `tree` is the tree of `mesh`. Both must outlive the guard. \pre fewer than 2^32 triangles
    DeviationGuard(const Mesh& mesh, const TriangleTree& tree, double max_distance);

    /// If it accepts a collapse, assigns the points of the triangles to the patch.
    /// Threads may call it at the same time.
    bool accept(std::span<const std::uint32_t> removed, std::span<const PatchTriangle> patch) override;

  private:
    static constexpr std::uint32_t kNone = ~std::uint32_t{0};
    struct Assignment {
        Vec3d position;
        std::uint32_t point, triangle;
        std::uint32_t guess;  // the number in the patch of the triangle that it was assigned to
    };
    // A position of the patch, and the original point nearest to it.
    struct Position {
        Vec3d at;
        std::uint32_t nearest = kNone;
    };
    // The plane of a triangle of the patch, through the common corner.
    struct Plane {
        Vec3d n;           // the normal, as long as twice the area
        Vec3d to_v, to_u;  // along the plane, across its edges from that corner
        double nn;         // n . n
    };
    static void set_planes(std::vector<Plane>& planes, std::span<const PatchTriangle> patch);
    bool points_stay_near(std::span<Assignment> assignments, std::span<const Plane> planes,
                          std::span<const PatchTriangle> patch) const;
    bool is_nearly_flat(std::size_t i, std::span<const Plane> planes,
                        std::span<const PatchTriangle> patch) const;
    void list_positions(std::vector<Position>& positions, std::span<const Assignment> assignments,
                        std::span<const Plane> planes, std::span<const PatchTriangle> patch) const;
    bool patch_is_near(std::span<const Position> positions) const;
    bool is_near(const Position& position) const;

    const Mesh& mesh_;
    const TriangleTree& tree_;
    const double max_distance_;
    // A point in the list of the triangle that it is assigned to, and the fan of its triangles. It takes half
    // a cache line.
    struct alignas(32) Listed {
        Vec3f position;
        std::uint32_t next;
        std::uint32_t first_neighbour, neighbours;  // in neighbours_; none: its triangles are no fan
    };
    std::span<const std::uint32_t> fan_of(std::uint32_t point) const {
        return {neighbours_.data() + listed_[point].first_neighbour, listed_[point].neighbours};
    }
    std::vector<std::uint32_t> first_point_;  // of each triangle: the first point of its list
    Buffer<Listed> listed_;
    Buffer<std::uint32_t> neighbours_;  // in the original mesh
    double most_bend_ = 0;  // squared sine of the angle between triangles that count as nearly flat
    struct Scratch {
        std::vector<Plane> planes;
        std::vector<Assignment> assignments;
        std::vector<Position> positions;
    };
    PerThread<Scratch> scratch_;  // kept for its memory
};

}  // namespace marrow::internal
