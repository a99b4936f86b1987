/// Finds where the surface of a mesh passes through itself.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <marrow/mesh.h>
#include <marrow/progress.h>

namespace marrow::internal {

/// The indices of two triangles, the lower index first.
using TrianglePair = std::array<std::uint32_t, 2>;

/// Returns the pairs of triangles that MeshCheck::self_intersections counts, sorted. Reports progress from
/// `begin` to `end`. The result does not depend on the number of threads.
/// \pre fewer than 2^32 triangles, none with equal indices, and finite coordinates \throw Cancelled
std::vector<TrianglePair> find_self_intersections(const Mesh& mesh, const Progress& progress = {},
                                                  double begin = 0, double end = 1);

/// Returns those of these pairs that have at least one of the triangles `changed`. If these are few, this is
/// much faster. \pre as above; indices are in range
std::vector<TrianglePair> find_self_intersections_of(const Mesh& mesh,
                                                     const std::vector<std::uint32_t>& changed);

}  // namespace marrow::internal
