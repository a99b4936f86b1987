/// Lists the edges of a mesh that are not between two triangles which agree in orientation.
#pragma once

#include <cstdint>
#include <vector>

#include "one_rings.h"

namespace marrow::internal {

/// An edge between two points, with the number of triangles that run along it in each direction.
struct Edge {
    std::uint32_t lower, higher;
    std::int64_t up = 0, down = 0;  ///< from lower to higher, and from higher to lower

    bool is_border() const { return up + down == 1; }
    bool is_misoriented() const { return up + down == 2 && up != down; }
    bool is_manifold() const { return up == 1 && down == 1; }
};

/// The edges of a mesh that are not manifold, ordered by their points. Takes nearly no time if all points are
/// regular, and else nearly linear time.
std::vector<Edge> irregular_edges(const OneRings& rings);

}  // namespace marrow::internal
