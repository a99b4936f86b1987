/// Measures where the points of a slice are on their edges.
#pragma once

#include <cstdint>

#include "core/marching_cubes/emit.h"
#include "slice.h"

namespace marrow::internal {

/// Fills the edges of slice z. On entry, its offsets are the fractions that emit_points() writes; on return,
/// they are the distances from the nearer ends. A point is near if that distance is at most `limit`.
void measure_slice(const EmitInput& input, float limit, std::int64_t z, SnapSlice& slice);

}  // namespace marrow::internal
