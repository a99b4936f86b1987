/// The 256 cases of a cell: which edges the surface crosses, and how their points form triangles.
///
/// The table is not copied from anywhere. It is derived at compile time from one rule for the faces:
///
///   walk around a face; the surface cuts off each unbroken run of inside corners.
///
/// So two diagonal inside corners of a face are always separated, and the outside is connected between them.
/// The rule looks at the face alone. Therefore the two cells that share a face draw the same lines on it, and
/// no hole can open. The lines of the six faces close into loops. Each loop of k points becomes k - 2
/// triangles, chosen so that no diagonal lies in a face: a neighbour could have the same diagonal there, and
/// four triangles would meet at it.
///
/// Corner v of a cell is at (v & 1, v >> 1 & 1, v >> 2): x is bit 0, y bit 1, z bit 2. Bit v of a case is set
/// if corner v is inside.
///
/// Edges are numbered so that the ids of their points stay in one vector while a row of cells is emitted (see
/// emit_triangles.cpp):
///
///   0..3   along x at (y, z) = (0,0) (1,0) (0,1) (1,1)
///   4, 5   along y at x = 0, z = 0, 1        8, 9    the same at x = 1
///   6, 7   along z at x = 0, y = 0, 1        10, 11  the same at x = 1
#pragma once

#include <array>
#include <cstdint>

namespace marrow::internal {

inline constexpr int kCellEdges = 12;
inline constexpr int kMaxTriangles = 5;  ///< of a cell

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

/// How the surface passes through a cell.
struct Case {
    std::uint16_t crossed = 0;  ///< bit e: edge e has a point
    std::uint8_t loops = 0;     ///< closed lines that the surface draws on the faces
    std::uint8_t triangles = 0;
    /// Three edge numbers per triangle, counter-clockwise seen from outside the surface. The rest is 0.
    std::array<std::uint8_t, 16> edges{};
};

/// A case in the form that emission needs. While a row of cells passes by, edges 0 to 7 each have a counter
/// that holds the id of the next point there. The point of edge e >= 8 has the id after that of edge e - 4,
/// because edge e is edge e - 4 of the next cell.
struct alignas(32) RunningCase {
    /// Three per triangle. Bits 0 to 2 are the counter that holds the point's id. Bit 3 is added to the
    /// counter.
    std::uint8_t ids[16] = {};
    std::uint8_t advance[8] = {};  ///< what each counter gains before the next active cell
    std::uint8_t triangles = 0;
};

/// The table, indexed by case. In the mirrored one every triangle is turned over, for index-to-physical maps
/// that mirror.
extern const std::array<Case, 256> kCases, kMirroredCases;
/// The table for emission. Its index has the corners in the order of the rows of samples: bits 0 to 3 are the
/// corners at the cell's x, bits 4 to 7 those at x + 1, both at (y, z) = (0,0) (1,0) (0,1) (1,1).
extern const std::array<RunningCase, 256> kRunningCases, kMirroredRunningCases;

}  // namespace marrow::internal
