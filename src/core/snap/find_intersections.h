/// Finds where a snapped surface passes through itself.
#pragma once

#include <cstdint>
#include <vector>

#include "base/progress.h"
#include "core/marching_cubes/emit.h"
#include "mesh/search/triangle_pyramid.h"
#include "snap_output.h"

namespace marrow::internal {

/// Returns pairs that find_self_intersections() returns for the surface: at least those with a triangle in a
/// layer that is marked with 1. `surface` has all slices, whose points are up to `limit` edges away from
/// where they are without snapping, along any axis of the grid. \throw Cancelled
std::vector<TrianglePair> find_intersections(const EmitInput& input, double limit, const SnapOutput& surface,
                                             const std::vector<std::uint8_t>& layers,
                                             const Progress& progress, double begin, double end);

}  // namespace marrow::internal
