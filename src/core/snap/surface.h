/// Makes a snapped surface, as a whole or slice by slice, before caps are widened.
#pragma once

#include <cstddef>
#include <cstdint>
#include <set>
#include <vector>

#include "base/progress.h"
#include "core/marching_cubes/emit.h"
#include "snap_exceptions.h"
#include "snap_output.h"

namespace marrow::internal {

/// Makes the surface of all slices, in the memory of the mesh of `surface`. Returns the bytes of memory that
/// this took besides. `limit`: as IsosurfaceOptions::snap \throw Cancelled
std::size_t make_surface(const EmitInput& input, const SnapExceptions& exceptions, float limit, bool normals,
                         const Progress& progress, SnapOutput& surface);

/// Makes the slices again that may differ because the samples in the slices `changed` have become exceptions,
/// and marks them with 1. `layers` has an element for each slice; slices that are marked already are made
/// again, too. \pre caps are not widened \throw Cancelled
void make_again(const EmitInput& input, const SnapExceptions& exceptions, float limit,
                const std::set<std::int64_t>& changed, const Progress& progress, SnapOutput& surface,
                std::vector<std::uint8_t>& layers);

}  // namespace marrow::internal
