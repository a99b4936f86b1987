/// The numbering of the corners, edges and faces of a cell.
///
/// Corner v of a cell is at (v & 1, v >> 1 & 1, v >> 2): x is bit 0, y bit 1, z bit 2.
///
/// Edges are numbered so that the ids of their points stay in one vector while a row of cells is emitted (see
/// emit_triangles.cpp):
///
///   0..3   along x at (y, z) = (0,0) (1,0) (0,1) (1,1)
///   4, 5   along y at x = 0, z = 0, 1        8, 9    the same at x = 1
///   6, 7   along z at x = 0, y = 0, 1        10, 11  the same at x = 1
#pragma once

#include <cstdint>

namespace marrow::internal {

inline constexpr int kCellEdges = 12;

/// The two corners of each edge, the one with the lower coordinate first.
inline constexpr std::uint8_t kEdgeCorners[kCellEdges][2] = {{0, 1}, {2, 3}, {4, 5}, {6, 7}, {0, 2}, {4, 6},
                                                             {0, 4}, {2, 6}, {1, 3}, {5, 7}, {1, 5}, {3, 7}};

/// The edge between two corners, or -1 if there is none.
constexpr int edge_between(int corner_a, int corner_b) {
    for (int e = 0; e < kCellEdges; ++e) {
        const int first = kEdgeCorners[e][0], second = kEdgeCorners[e][1];
        if ((first == corner_a && second == corner_b) || (first == corner_b && second == corner_a)) return e;
    }
    return -1;
}

/// The corners of each face, counter-clockwise seen from outside the cell: x = 0, 1, y = 0, 1, z = 0, 1.
inline constexpr std::uint8_t kFaceCorners[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                                    {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};

}  // namespace marrow::internal
