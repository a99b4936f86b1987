/// Pass 4, where wanted: the points round a sample that the surface passes close to become one.
#pragma once

#include <cstddef>

#include <marrow/mesh.h>
#include <marrow/progress.h>

#include "emit.h"

namespace marrow::internal {

/// Snaps the whole mesh that was emitted from `input`; `limit` as IsosurfaceOptions::snap. Returns the bytes
/// of memory that took beside the mesh. Reports progress from 0.6 to 1. \throw Cancelled; std::bad_alloc
std::size_t snap(const EmitInput& input, double limit, const Progress& progress, Mesh& mesh);

}  // namespace marrow::internal
