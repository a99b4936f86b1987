/// Keeps surfaces from passing through themselves while their points move.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include <marrow/buffer.h>
#include <marrow/mesh.h>
#include <marrow/progress.h>

#include "one_rings.h"

namespace marrow::internal {

/// The points of some meshes.
using Positions = std::vector<std::span<const Vec3f>>;

/// Moves points of a mesh back along straight paths, towards the positions that they came from, until the
/// surface passes through itself only where it did so at the start. Returns how many points it moved.
/// `start` returns the positions before the move, which it keeps; it is called at most once, and only if they
/// are needed.
/// The result does not depend on the number of threads. Reports progress from `begin` to `end`.
/// `rings` are those of the mesh. \pre as for SelfIntersections \throw Cancelled
std::size_t hold_back(Mesh& mesh, const OneRings& rings, const std::function<Positions()>& start,
                      const Progress& progress = {}, double begin = 0, double end = 1);

/// The same for several meshes, each of which may pass through the others. Points with the same number in
/// `numbers`, which has one for each point of each mesh, move together; they are counted once.
std::size_t hold_back(std::span<Mesh> meshes, const std::vector<Buffer<std::uint32_t>>& numbers,
                      const std::function<Positions()>& start, const Progress& progress = {},
                      double begin = 0, double end = 1);

}  // namespace marrow::internal
