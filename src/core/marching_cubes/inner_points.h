/// The points inside a cell.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <marrow/vector.h>

#include "cell_topology.h"

namespace marrow::internal {

/// The points inside a cell whose corners are at 0 and 1 on each axis. Returns how many there are.
///
/// A fan has its point near the middle of its loop, moved towards the surface. A tunnel has a hexagon of
/// points that lie on the surface where the slices with a cross meet.
int place_inner_points(const CellTopology& topology, const CellValues& values,
                       std::array<Vec3d, CellTopology::kTunnelPoints>& points);

/// The point on an edge of that cell. \pre the values are well scaled, and differ in sign at its ends
Vec3d edge_point(const CellValues& values, std::size_t edge);

/// The value of the trilinear interpolant, and its gradient.
struct Interpolant {
    double value;
    Vec3d gradient;

    Interpolant(const CellValues& corners, const Vec3d& at);
};

}  // namespace marrow::internal
