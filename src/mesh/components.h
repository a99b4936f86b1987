/// Which triangles hang together.
#pragma once

#include <cstdint>
#include <vector>

#include <marrow/mesh.h>

namespace marrow::internal {

/// For each point the lowest point that it is connected with through triangles; itself where no triangle has
/// it.
std::vector<std::uint32_t> lowest_connected_points(const Mesh& mesh);

}  // namespace marrow::internal
