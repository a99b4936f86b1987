/// Proves for most of a surface that it does not pass through itself, without looking at pairs of triangles.
#pragma once

#include <cstdint>
#include <vector>

#include <marrow/buffer.h>
#include <marrow/mesh.h>

#include "one_rings.h"

namespace marrow::internal {

/// Returns the triangles that may intersect others, in ascending order. All others certainly meet other triangles only in
/// the edges and corners that they share. `rings` are those of the mesh. Takes linear time, on all threads.
/// \pre fewer than 2^32 triangles
Buffer<std::uint32_t> triangles_outside_height_fields(const MeshView& mesh, const OneRings& rings);

}  // namespace marrow::internal
