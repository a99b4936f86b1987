/// Finds where the surface of a mesh passes through itself.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <marrow/mesh.h>
#include <marrow/progress.h>

#include "mesh/connectivity/one_rings.h"
#include "mesh/search/triangle_pyramid.h"
#include "triangle_blocks.h"

namespace marrow::internal {

/// Finds the pairs of triangles that MeshCheck::self_intersections counts, with progress from `begin` to
/// `end`. They are sorted and do not depend on the number of threads. `rings` are those of the mesh.
/// \pre fewer than 2^32 triangles, none with equal indices \throw Cancelled
std::vector<TrianglePair> find_self_intersections(const MeshView& mesh, const OneRings& rings,
                                                  const Progress& progress = {}, double begin = 0,
                                                  double end = 1);

/// The same, with the blocks of the mesh.
std::vector<TrianglePair> find_self_intersections(const MeshView& mesh, const OneRings& rings,
                                                  const std::optional<TriangleBlocks>& blocks,
                                                  const Progress& progress = {}, double begin = 0,
                                                  double end = 1);

/// The same for a mesh that was made again. It differs from the mesh `before` in places; in others, both have
/// the same triangles at the same positions, and the points are in the same order. `pairs_before` are those
/// of that mesh. Looks only at triangles around changed points, and around these pairs. \pre at most two
/// triangles meet at an edge, in both meshes \throw Cancelled
std::vector<TrianglePair> find_self_intersections_again(const MeshView& mesh, const MeshView& before,
                                                        const std::vector<TrianglePair>& pairs_before,
                                                        const Progress& progress = {}, double begin = 0,
                                                        double end = 1);

/// Finds such pairs again where a mesh has changed.
class SelfIntersections {
  public:
    /// \pre as for find_self_intersections()
    explicit SelfIntersections(MeshView mesh);
    SelfIntersections(SelfIntersections&& other) noexcept;
    ~SelfIntersections();

    /// Finds the pairs that have at least one of the triangles `changed`. These must include all triangles
    /// that have changed since the last search. The pairs are sorted.
    std::vector<TrianglePair> find_changed(const std::vector<std::uint32_t>& changed);

    /// Takes note of triangles that have changed, without a search.
    void update(const std::vector<std::uint32_t>& changed);

    /// Leaves a triangle out of later searches, until it is among the changed ones again.
    void remove(std::uint32_t triangle);

    /// Returns the triangles at a point that has not moved since the last search, in a fixed order.
    std::vector<std::uint32_t> triangles_at(std::uint32_t point) const;

  private:
    struct Search;
    std::unique_ptr<Search> search_;
};

}  // namespace marrow::internal
