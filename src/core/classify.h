/// Pass 1: samples -> inside bits.
#pragma once

#include <cstdint>

#include <marrow/volume.h>

#include "inside_bits.h"

namespace marrow::internal {

/// Writes the inside bits of grid slices [z_begin, z_end), padding included.
/// Returns how many of their samples are NaN or infinite.
std::int64_t classify_slices(const VolumeView& volume, double isovalue, std::int64_t z_begin,
                             std::int64_t z_end, InsideBits& bits) noexcept;

}  // namespace marrow::internal
