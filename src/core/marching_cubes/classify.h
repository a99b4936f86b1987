/// Pass 1: compares samples with the isovalue and writes inside bits.
#pragma once

#include <cstdint>

#include <marrow/volume.h>

#include "block_ranges.h"
#include "inside_bits.h"

namespace marrow::internal {

/// Writes the inside bits of a slice of the grid and, unless `ranges` is null, the ranges of its blocks.
/// Returns the number of NaN and infinite samples.
std::int64_t classify_slice(const VolumeView& volume, double isovalue, std::int64_t grid_z, InsideBits& bits,
                            BlockRanges* ranges) noexcept;

/// Changes the inside bits of a slice from isovalue `from` to isovalue `to`. Reads only the blocks whose
/// range holds `to`.
void reclassify_slice(const VolumeView& volume, double from, double to, std::int64_t grid_z, InsideBits& bits,
                      BlockRanges& ranges) noexcept;

}  // namespace marrow::internal
