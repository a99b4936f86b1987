/// Computes the normals of a mesh from its triangles.
#pragma once

#include <marrow/mesh.h>

namespace marrow::internal {

/// Returns a unit normal for each point, from its triangles, weighted after Max 1999; this is exact on a
/// sphere. If the triangles' normals cancel, the result is {1, 0, 0}. \pre indices are in range
Buffer<Vec3f> point_normals(const MeshView& mesh);

}  // namespace marrow::internal
