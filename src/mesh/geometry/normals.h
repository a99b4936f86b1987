/// Computes the normals of a mesh from its triangles.
#pragma once

#include <marrow/mesh.h>

namespace marrow::internal {

/// Gives each point a unit normal from its triangles, weighted after Max 1999, which is exact on a sphere.
/// Those that point against their faces are replaced. \pre indices are in range
void set_normals(Mesh& mesh);

}  // namespace marrow::internal
