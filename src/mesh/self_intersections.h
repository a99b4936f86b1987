/// Counts where the surface of a mesh passes through itself.
#pragma once

#include <cstdint>

#include <marrow/mesh.h>
#include <marrow/progress.h>

#include "triangle_tree.h"
#include "vertex_triangles.h"

namespace marrow::internal {

/// Returns MeshCheck::self_intersections. The tree and the vertex triangles are those of the mesh. Reports
/// progress from `begin` to `end`. \throw Cancelled
std::int64_t count_self_intersections(const MeshView& mesh, const TriangleTree& tree,
                                      const VertexTriangles& vertex_triangles, const Progress& progress,
                                      double begin, double end);

}  // namespace marrow::internal
