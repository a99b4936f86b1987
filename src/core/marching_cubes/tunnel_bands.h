/// The bands of triangles between the loops of a cell and the ring of points of its tunnel.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "cell_topology.h"

namespace marrow::internal {

/// A band of triangles between a loop and the ring of a tunnel's points. From each point of the loop it takes
/// up to two steps along the ring, and then the one along the loop. So no point of either is linked to all
/// points of the other, and the band is a manifold whatever the positions are.
struct Band {
    static constexpr std::size_t kRing = CellTopology::kTunnelPoints;
    /// The squared distances of the points of a loop from those of the ring.
    using Distances = double[kCellEdges][kRing];

    std::size_t start = 0;      ///< the ring's point with which the first of the loop is linked
    std::size_t direction = 1;  ///< from one point of the ring to the next: 1, or kRing - 1 for backwards
    std::array<std::uint8_t, kCellEdges> steps{};  ///< along the ring at each point of the loop
    double cost = 0;                               ///< the sum of the squared lengths of the links

    std::size_t ring_point(std::size_t step) const { return (start + direction * step) % kRing; }
};

/// For each direction: what the shortest band of each start costs, and which steps it takes.
struct BandsOfStarts {
    static constexpr std::size_t kStarts = 8;  ///< those beyond the ring's points repeat the first ones
    static constexpr std::size_t kPlaces = Band::kRing + 1;  ///< after 0 to kRing steps

    alignas(64) double cost[2][kStarts];
    /// At each point of the loop, the last steps before each place.
    alignas(64) double steps[2][kCellEdges][kPlaces][kStarts];
};

/// The shortest band in each of the two directions around the ring, for a loop of `size` points. Among
/// several, it is that of the least start. The same on every SIMD target.
std::array<Band, 2> shortest_bands(const Band::Distances& squared, std::size_t size);

/// All bands of a loop of `size` points in one of the two directions around the ring, the shortest first.
std::vector<Band> all_bands(const Band::Distances& squared, std::size_t size, bool backwards);

}  // namespace marrow::internal
