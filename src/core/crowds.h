/// Where the surface passes close to a sample: the points that crowd round it become one, or keep away.
#pragma once

#include <cstdint>

#include "emit.h"
#include "snap_slice.h"

namespace marrow::internal {

/// Joins the points that crowd round the samples of slice z, or moves them apart. By number, `one` receives which
/// point each becomes, which has its new place then, and `moved` how far each was moved, in edges. \pre both slices
/// are measured, and the one before is joined unless z is the first; the points stand for themselves in `one`
void join_slice(const EmitInput& input, float limit, std::int64_t z, SnapSlice& before, SnapSlice& slice,
                std::uint32_t* one, float* moved);

}  // namespace marrow::internal
