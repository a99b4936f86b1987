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
/// With exact topology, the samples decide which ambiguous faces join their inside corners
/// instead. In a joined face the surface cuts off the two outside corners, and the same
/// derivation makes the shapes of kShapes.
///
/// Bit v of a case is set if corner v is inside. core/grid/cell.h numbers corners and edges.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/grid/cell.h"

namespace marrow::internal {

inline constexpr int kMaxTriangles = 5;  ///< of a cell

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
    std::uint8_t ids[3 * kMaxTriangles] = {};
    std::uint8_t triangles = 0;
    /// What each counter gains before the next active cell, twice: a vector may hold the counters and, after
    /// them, what follows each.
    std::uint8_t advance[16] = {};
};

/// The same of a case or of a shape without inner points, which may have more triangles.
struct alignas(64) RunningShape {
    static constexpr std::size_t kIds = 32;

    std::uint8_t ids[kIds] = {};
    std::uint8_t advance[16] = {};
    std::uint8_t triangles = 0;
};

/// How the surface passes through a cell in which some ambiguous faces join their inside corners.
struct CellShape {
    static constexpr int kMaxTriangles = 12, kMaxLoops = 4;
    /// The number, in `corners`, of the point inside the cell. 116 of the 656 shapes have a loop that no
    /// triangles without sides in the faces fill. It becomes a fan around this point.
    static constexpr std::uint8_t kInnerPoint = kCellEdges;

    std::uint16_t crossed = 0;  ///< bit e: edge e has a point
    std::uint8_t loops = 0;
    std::uint8_t triangles = 0;
    bool has_fan = false;
    /// The edges of the loops, one loop after the other, and the end of each loop.
    std::array<std::uint8_t, kCellEdges> loop_edges{};
    std::array<std::uint8_t, kMaxLoops> loop_ends{};
    /// Three edge numbers, or kInnerPoint, per triangle.
    std::array<std::uint8_t, 3 * kMaxTriangles> corners{};

    std::span<const std::uint8_t> loop(std::size_t k) const {
        const std::size_t first = k == 0 ? 0 : loop_ends[k - 1];
        return {loop_edges.data() + first, loop_ends[k] - first};
    }
};

/// The table, indexed by case. In the mirrored one every triangle is turned over, for index-to-physical maps
/// that mirror.
extern const std::array<Case, 256> kCases, kMirroredCases;
/// The table for emission. Its index has the corners in the order of the rows of samples: bits 0 to 3 are the
/// corners at the cell's x, bits 4 to 7 those at x + 1, both at (y, z) = (0,0) (1,0) (0,1) (1,1).
extern const std::array<RunningCase, 256> kRunningCases, kMirroredRunningCases;

/// Bit f: face f of the case is ambiguous (the order of the faces is that of kFaceCorners).
extern const std::array<std::uint8_t, 256> kAmbiguousFaces;
/// The shapes of all cases. Those of case c begin at kFirstShape[c], in the order of their joined
/// faces: bit k of a shape's place is set if the k-th ambiguous face is joined. So the first
/// joins none, and is that of kCases.
inline constexpr int kShapeCount = 656;
extern const std::array<std::uint16_t, 256> kFirstShape;
extern const std::array<CellShape, kShapeCount> kShapes;
/// Those of the cases in the order of kRunningCases, and from kFirstRunningShape on those of kShapes.
inline constexpr int kFirstRunningShape = 256, kRunningShapeCount = kFirstRunningShape + kShapeCount;
extern const std::array<RunningShape, kRunningShapeCount> kRunningShapes, kMirroredRunningShapes;
/// What a shape has more than its case.
struct ShapeChange {
    std::int8_t more_triangles = 0;
    std::uint8_t inner_points = 0;
};
extern const std::array<ShapeChange, kShapeCount> kShapeChanges;

}  // namespace marrow::internal
