/// Proves for most of a surface that it does not pass through itself, without looking at pairs of triangles.
#pragma once

#include <cstdint>

#include <marrow/buffer.h>

#include "triangle_blocks.h"

namespace marrow::internal {

/// Returns the triangles of a mesh that may intersect others, in ascending order. All others certainly meet
/// triangles only in the edges and corners that they share. Runs on all threads.
Buffer<std::uint32_t> triangles_outside_height_fields(const TriangleBlocks& placed);

}  // namespace marrow::internal
