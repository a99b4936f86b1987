/// Triangles with a point nearly on the line between the two others.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <marrow/mesh.h>

#include "core/marching_cubes/emit.h"

namespace marrow::internal {

struct FlatTriangle {
    Triangle triangle;
    std::array<float, 3> moved;  ///< how far its points were moved already, in edges
};

/// Lists which of `count` triangles may be flat. `points` can be read for a float more than there are.
void find_flat(const Vec3f* points, const Triangle* triangles, std::size_t count,
               std::vector<std::uint32_t>& flat);

/// Moves aside the points that lie nearly on the line between the others of a triangle, within its plane, as
/// far as they may still move until they have moved by `limit`, in edges.
void move_aside(const EmitInput& input, double limit, const std::vector<FlatTriangle>& flat, Mesh& mesh);

}  // namespace marrow::internal
