/// Divides points into compact regions.
#pragma once

#include <cstddef>
#include <cstdint>

#include <marrow/buffer.h>
#include <marrow/mesh.h>

namespace marrow::internal {

/// Returns the number of the region of each point of a mesh, from 1 to `count`. Regions are successive
/// cells of a coarse grid over the triangles along a Morton curve, with about as many points each. They
/// depend only on the mesh. Runs on all threads.
/// \pre 0 < count < 2^16; indices are in range
Buffer<std::uint16_t> divide_points(const MeshView& mesh, std::size_t count);

}  // namespace marrow::internal
