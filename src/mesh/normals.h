/// Normals of a mesh from its triangles.
#pragma once

#include <marrow/mesh.h>

namespace marrow::internal {

/// A unit normal for each point, from the triangles round it weighted as in Max 1999, which is exact on a
/// sphere; the first axis where they cancel. \pre triangles name points that are there
Buffer<Vec3f> point_normals(const Mesh& mesh);

}  // namespace marrow::internal
