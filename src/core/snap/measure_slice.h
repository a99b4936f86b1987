/// Measures where the points of a slice are on their edges.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/marching_cubes/emit.h"
#include "slice.h"

namespace marrow::internal {

inline constexpr std::size_t kListSlack = 4;

/// Fills the edges of slice z. On entry, its offsets are the fractions that emit_points() writes; on return,
/// they are the distances from the nearer ends. A point is near if that distance is at most `limit`.
/// Also writes the x of the sample at which the edge of each point starts. Up to kListSlack values after the
/// last one are overwritten.
void measure_slice(const EmitInput& input, float limit, std::int64_t z, SnapSlice& slice,
                   std::uint32_t* edge_x);

}  // namespace marrow::internal
