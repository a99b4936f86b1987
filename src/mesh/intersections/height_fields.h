/// Proves for most of a surface that it does not pass through itself, without looking at pairs of triangles.
#pragma once

#include <cstdint>

#include <marrow/buffer.h>

#include "triangle_blocks.h"

namespace marrow::internal {

/// Returns 0 for blocks in which the triangles certainly meet only in the edges and corners that they share,
/// and 1 for the others. There are padded_size() entries. Runs on all threads.
Buffer<std::uint8_t> blocks_outside_height_fields(const TriangleBlocks& placed);

}  // namespace marrow::internal
