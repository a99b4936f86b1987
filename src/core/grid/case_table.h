/// The 256 cases of a cell: which edges the surface crosses and how their points join into triangles.
///
/// The table is not copied from anywhere but derived, at compile time, from one rule for the faces:
///
///   walk round a face; the surface cuts off each unbroken run of inside corners.
///
/// Two diagonal inside corners of a face are thus always separated (the outside joins between them). The rule
/// looks at the face alone, so the two cells that share a face draw the same lines on it and no hole can
/// open. The lines of the six faces close into loops; each loop of k points becomes k - 2 triangles, chosen
/// so that no diagonal lies in a face (a neighbour could have the same line there, and four triangles would
/// meet in it).
///
/// Corner v of a cell is at (v & 1, v >> 1 & 1, v >> 2): x is bit 0, y bit 1, z bit 2. Bit v of a case is set
/// where corner v is inside.
///
/// Edges are numbered so that the running point ids of `emit` stay in one vector (see emit_triangles.cpp):
///
///   0..3   along x at (y, z) = (0,0) (1,0) (0,1) (1,1)
///   4, 5   along y at x = 0, z = 0, 1        8, 9    the same at x = 1
///   6, 7   along z at x = 0, y = 0, 1        10, 11  the same at x = 1
#pragma once

#include <array>
#include <cstdint>

namespace marrow::internal {

inline constexpr int kCellEdges = 12;
inline constexpr int kMaxTriangles = 5;

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

struct Case {
    std::uint16_t crossed = 0;  ///< bit e: edge e has a point
    std::uint8_t loops = 0;
    std::uint8_t triangles = 0;
    /// Edge numbers, three a triangle, counter-clockwise seen from outside the surface; 0 beyond.
    std::array<std::uint8_t, 16> edges{};
};

/// A case as emission reads it. Of a cell's edges, 0 to 7 each have a counter of the points that passed by on
/// the edges in their place in the cells before: the next id there. Edge e >= 8 is the next one in the place of
/// edge e - 4.
struct alignas(32) RunningCase {
    std::uint8_t ids[16] = {};  ///< three a triangle: the counter, and 8 where the point is the next but one
    std::uint8_t advance[8] = {};  ///< the counters' step to the next active cell
    std::uint8_t triangles = 0;
};

/// The table, indexed by case; and the same with every triangle turned over, for grids that are mirrored in
/// space.
extern const std::array<Case, 256> kCases, kMirroredCases;
/// The same, indexed by the corners in another order, as they lie in rows of samples: bits 0 to 3 those at the
/// cell's x, bits 4 to 7 those at x + 1, each time at (y, z) = (0,0) (1,0) (0,1) (1,1).
extern const std::array<RunningCase, 256> kRunningCases, kMirroredRunningCases;

}  // namespace marrow::internal
