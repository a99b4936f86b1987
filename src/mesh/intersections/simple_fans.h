/// Proves for most points of a mesh that the triangles around them do not intersect each other.
#pragma once

#include <cstdint>

#include <marrow/buffer.h>
#include <marrow/mesh.h>

#include "mesh/connectivity/one_rings.h"

namespace marrow::internal {

/// Returns 1 for points whose triangles certainly only meet in the edges that they share, and 0 for the other
/// points. Some of those are as simple, but rounding could be wrong, or their triangles look into directions
/// that are too different. The fans are tested on all threads. `rings` are those of a mesh with these points.
/// It may have more triangles; points without a triangle of `mesh` are not looked at.
Buffer<std::uint8_t> find_simple_fans(const MeshView& mesh, const OneRings& rings);

}  // namespace marrow::internal
