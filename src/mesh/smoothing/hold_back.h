/// Keeps surfaces from passing through themselves while their points move.
#pragma once

#include <cstddef>
#include <functional>
#include <span>

#include <marrow/mesh.h>
#include <marrow/progress.h>

#include "mesh/connectivity/one_rings.h"

namespace marrow::internal {

/// Moves points of a mesh back along straight paths, towards the positions that they came from, until the
/// surface passes through itself only where it did so at the start. Returns how many points it moved.
/// `start` returns the positions before the move, which it keeps; it is called at most once, and only if they
/// are needed.
/// The result does not depend on the number of threads. Reports progress from `begin` to `end`.
/// `rings` are those of the mesh. \pre as for SelfIntersections \throw Cancelled
std::size_t hold_back(Mesh& mesh, const OneRings& rings, const std::function<std::span<const Vec3f>()>& start,
                      const Progress& progress = {}, double begin = 0, double end = 1);

}  // namespace marrow::internal
