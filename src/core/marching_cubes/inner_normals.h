/// The normals at the points inside a cell.
#pragma once

#include <array>
#include <cstddef>

#include <marrow/vector.h>

#include "core/grid/index_to_physical.h"
#include "face_signs.h"

namespace marrow::internal {

/// What the normals in a cell follow from.
struct CellSlopes {
    /// Those between which the trilinear interpolant lies. Its gradient never turns the surface over.
    CellValues values;
    /// Whether there are gradients at the corners. What lies between them is smooth across cells.
    bool has_corners = false;
    std::array<Vec3d, 8> corners;
};

/// Computes the normals at up to eight points of a cell whose corners are at 0 and 1 on each axis. They have
/// the direction of what lies between the gradients at the corners. Where there are none, or that would turn
/// the surface over, they have the direction of the interpolant's gradient. The same on every SIMD target.
void inner_normals(const CellSlopes& cell, const Vec3d* points, std::size_t count,
                   const IndexToPhysical& to_physical, Vec3f* normals);

}  // namespace marrow::internal
