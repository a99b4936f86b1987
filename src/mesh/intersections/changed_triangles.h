/// Finds where a mesh that was made again differs from the one before.
#pragma once

#include <cstdint>
#include <vector>

#include <marrow/buffer.h>
#include <marrow/mesh.h>

#include "mesh/search/triangle_pyramid.h"

namespace marrow::internal {

/// Returns the triangles near those that `before` does not have, and near the pairs of triangles of
/// `before`, in ascending order. They include all triangles whose bounding boxes overlap or touch
/// these. Points and triangles that both meshes have are in the same order in both; of others, there
/// are few. \pre indices are in range
Buffer<std::uint32_t> triangles_around_changes(const MeshView& mesh, const MeshView& before,
                                               const std::vector<TrianglePair>& pairs);

}  // namespace marrow::internal
