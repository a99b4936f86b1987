/// The triangles of a tunnel between its two loops.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "cell_topology.h"
#include "inner_points.h"

namespace marrow::internal {

/// The triangles of a cell with a tunnel. Numbers below kCellEdges are edges; higher ones,
/// less kCellEdges, inner points.
struct TunnelTriangles {
    static constexpr std::size_t kMost = 22;
    /// Where the points with these numbers are in the cell, whose corners are at 0 and 1 on each axis.
    using Points = std::array<Vec3d, kCellEdges + CellTopology::kTunnelPoints>;

    std::size_t count = 0;
    std::array<std::uint8_t, 3 * kMost> corners;

    void add(std::size_t a, std::size_t b, std::size_t c);
    std::array<std::size_t, 3> triangle(std::size_t k) const {
        return {corners[3 * k], corners[3 * k + 1], corners[3 * k + 2]};
    }
};

/// Spans the shortest bands between its loops and its ring that do not pass through each other or themselves.
/// \pre topology.has_tunnel()
TunnelTriangles triangulate_tunnel(const CellTopology& topology, const CellValues& values);

}  // namespace marrow::internal
