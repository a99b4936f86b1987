/// Finds which points of a mesh are connected through triangles.
#pragma once

#include <cstdint>

#include <marrow/buffer.h>
#include <marrow/mesh.h>

namespace marrow::internal {

/// Returns for each point the lowest point that it is connected with through triangles. A point without a
/// triangle gets its own index. Takes nearly linear time, on all threads; the result is the same for any
/// number of them. \pre indices are in range
Buffer<std::uint32_t> lowest_connected_points(const MeshView& mesh);

}  // namespace marrow::internal
