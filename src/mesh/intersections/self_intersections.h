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

/// Finds those of these pairs that have only triangles of a list, in ascending order. The list has all
/// triangles that share an edge with one of such a pair.
std::vector<TrianglePair> find_self_intersections_among(const MeshView& mesh,
                                                        const Buffer<std::uint32_t>& triangles,
                                                        const Progress& progress = {}, double begin = 0,
                                                        double end = 1);

/// Whether a pair can be one of these. True for few others: then the triangles touch.
bool may_pass_through(const MeshView& mesh, const TrianglePair& pair);

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

    /// Whether find_changed() would find a pair. This is faster if the triangles are few and near each other.
    bool any_changed_pair(const std::vector<std::uint32_t>& changed);

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
