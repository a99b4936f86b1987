/// Pass 3 with snapping: points that crowd round a sample are one, and triangles that would collapse are not
/// there.
#pragma once

#include <cstddef>

#include <marrow/mesh.h>
#include <marrow/progress.h>

#include "core/marching_cubes/emit.h"

namespace marrow::internal {

/// Makes the snapped mesh; `limit` as IsosurfaceOptions::snap. Returns the bytes of memory that took beside it.
/// \throw Cancelled; std::bad_alloc
std::size_t snap(const EmitInput& input, double limit, bool normals, const Progress& progress, Mesh& mesh);

}  // namespace marrow::internal
