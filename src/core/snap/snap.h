/// The last pass with snapping: points close to the same sample merge, and triangles that collapse are left
/// out.
#pragma once

#include <cstddef>

#include <marrow/mesh.h>
#include <marrow/progress.h>

#include "core/marching_cubes/emit.h"

namespace marrow::internal {

/// Makes the snapped mesh; `limit` as IsosurfaceOptions::snap. Returns the bytes of memory used besides the
/// mesh. \throw Cancelled; std::bad_alloc
std::size_t snap(const EmitInput& input, double limit, bool normals, const Progress& progress, Mesh& mesh);

}  // namespace marrow::internal
