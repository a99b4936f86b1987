/// Opens folds of relaxed surface nets.
#pragma once

#include <cstddef>
#include <functional>
#include <span>

#include <marrow/mesh.h>

namespace marrow::internal {

/// Where two triangles at an edge lie on each other, moves their corners back along straight paths, towards the positions
/// that they came from, until none do that did not at the start. Returns how many points it moved. Other triangles at the
/// edge would be on the wrong side of one of the two, although no triangle passes through another.
/// `start` returns the positions at the start, which it keeps; it is called only if they are needed.
/// The result does not depend on the number of threads. \pre fewer than 2^32 triangles
std::size_t unfold(Mesh& net, const std::function<std::span<const Vec3f>()>& start);

}  // namespace marrow::internal
