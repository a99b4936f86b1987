/// Keeps a surface from passing through itself while its points move.
#pragma once

#include <cstddef>
#include <vector>

#include <marrow/buffer.h>
#include <marrow/mesh.h>
#include <marrow/progress.h>

namespace marrow::internal {

/// Moves points of a mesh back along straight paths, towards the positions `start` that they came from, until
/// the surface passes through itself only where it did so at the start. Returns how many points it moved.
/// The result does not depend on the number of threads. Reports progress from `begin` to `end`.
/// \pre there is a start for each point; as for SelfIntersections \throw Cancelled
std::size_t hold_back(const Buffer<Vec3f>& start, Mesh& mesh, const Progress& progress = {}, double begin = 0,
                      double end = 1);

}  // namespace marrow::internal
