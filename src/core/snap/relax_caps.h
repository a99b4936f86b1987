/// Widens cap triangles, in which one corner is nearly on the line between the two others.
#pragma once

#include <vector>

#include <marrow/mesh.h>

#include "cap_triangles.h"
#include "core/marching_cubes/emit.h"

namespace marrow::internal {

/// Moves the corners of caps within the planes of the triangles until their angles are large enough. A point
/// moves by `limit` at most, in edges, including how far merging moved it.
void relax_caps(const EmitInput& input, double limit, const std::vector<CapTriangle>& caps, Mesh& mesh);

}  // namespace marrow::internal
