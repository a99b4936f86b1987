/// The points inside a cell, and the triangles of a tunnel between its loops.
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

/// The triangles of a cell with a tunnel. Numbers below kCellEdges are edges; higher ones,
/// less kCellEdges, inner points.
struct TunnelTriangles {
    static constexpr std::size_t kMost = 22;

    int count = 0;
    std::array<std::uint8_t, 3 * kMost> corners;

    void add(std::size_t a, std::size_t b, std::size_t c);
};

/// \pre topology.has_tunnel
TunnelTriangles triangulate_tunnel(const CellTopology& topology, const CellValues& values);

/// The value of the trilinear interpolant, and its gradient.
struct Interpolant {
    double value;
    Vec3d gradient;

    Interpolant(const CellValues& corners, const Vec3d& at);
};

}  // namespace marrow::internal
