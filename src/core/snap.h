/// Pass 3 with snapping: points that crowd round a sample are one, and triangles that would collapse are not there.
#pragma once

#include <cstddef>

#include <marrow/mesh.h>
#include <marrow/progress.h>

#include "emit.h"

namespace marrow::internal {

/// Makes the snapped mesh; `limit` as IsosurfaceOptions::snap. `mesh` comes with room for the unsnapped one, and
/// normals if they are wanted. Returns the bytes of memory that took beside. Reports progress from 0.4 to 1.
/// \throw Cancelled; std::bad_alloc
std::size_t snap(const EmitInput& input, double limit, const Progress& progress, Mesh& mesh);

}  // namespace marrow::internal
