/// One cell of a label map: where borders pass through it.
///
/// Corners and edges are numbered as in case_table.h. A grid edge is crossed where its ends have different labels. On each face
/// of the cell the crossed edges are joined by knots:
///
///   two or three crossed edges, or four labels          one knot joins all
///   two labels across both diagonals (a b / b a)         the smaller label connects: a knot round each corner of the larger
///   one label across one diagonal only (a b / c a)       it connects: a knot round each of its neighbours
///
/// The rule looks at the face alone, so the two cells that share it agree. Crossed edges that knots join, on whatever face,
/// make a patch; each patch of a cell has its own point. Within a knot every label has two crossed edges or none, so that the
/// edges of a label's surface have two patches each.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "case_table.h"

namespace marrow::internal {

inline constexpr int kCellEdges = 12;

/// The edge between two corners.
constexpr int edge_between(int a, int b) {
    for (int e = 0; e < kCellEdges; ++e) {
        if (kEdgeCorners[e][0] == std::min(a, b) && kEdgeCorners[e][1] == std::max(a, b)) return e;
    }
    return -1;
}

/// For each face its edges; edge i runs from its corner i to corner i + 1.
inline constexpr std::array<std::array<int, 4>, 6> kFaceEdges = [] {
    std::array<std::array<int, 4>, 6> result{};
    for (std::size_t f = 0; f < 6; ++f) {
        for (std::size_t i = 0; i < 4; ++i)
            result[f][i] = edge_between(kFaceCorners[f][i], kFaceCorners[f][(i + 1) % 4]);
    }
    return result;
}();

/// What the crossed edges alone say, by their mask.
struct CrossedCell {
    std::array<float, 3> centre{};  ///< the mean of the crossed edges' middles, about the cell's first corner
    std::uint8_t faces = 0;         ///< bit f: face f (order of kFaceCorners) has crossed edges
    std::uint8_t junctions = 0;     ///< bit f: and three or more labels
    bool simple = false;            ///< surely one patch, where every label's edges make one loop
};

/// The table, indexed by the mask of crossed edges.
const std::array<CrossedCell, 4096>& crossed_cells();

/// The patches of a cell by its labels.
struct CellPatches {
    int patches = 0;
    std::array<std::int8_t, kCellEdges> patch_of_edge;  ///< -1: not crossed
    /// Where the edges of one label make several loops in a patch, those beyond the first have a point of their own at the
    /// same place: for each edge and its two ends the point, counted on behind the patches.
    std::array<std::array<std::int8_t, 2>, kCellEdges> point;
    int points = 0;  ///< patches and such points
    std::array<std::int8_t, 2 * kCellEdges> patch_of_point;
    /// The knot of each edge on each face, 0 or 1; -1 where the face has but one.
    std::array<std::array<std::int8_t, kCellEdges>, 6> knot;
    bool simple = false;  ///< one point, and no face with two knots
};

/// \param labels of the eight corners; their order says which is smaller
CellPatches patches_of(const std::array<std::int64_t, 8>& labels);

}  // namespace marrow::internal
