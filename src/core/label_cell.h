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
#include <memory>
#include <unordered_map>
#include <vector>

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

/// In which slice of samples an edge begins, above the cell's.
constexpr std::size_t edge_slice(std::size_t e) {
    return kEdgeCorners[e][0] >> 2;
}

/// About the middle of its cell, in samples. Four numbers to a point are as quick as three; the fourth is 0.
struct alignas(16) NetPoint {
    float at[4] = {};
};

/// Which of a cell's corners are alike: its labels are numbered in the order in which they come at corners.
struct CellCorners {
    std::array<std::uint8_t, 8> label{};
    int labels = 0;
    std::uint8_t faces =
        0;  ///< bit f: the label at the first corner of face f is smaller than that at the second

    /// Fills `values` with the labels by their numbers; those of corners can be compared and ordered.
    template <class Value>
    CellCorners(const std::array<Value, 8>& corners, std::array<Value, 8>& values) {
        for (std::size_t v = 0; v < 8; ++v) {
            int n = 0;
            while (n < labels && values[static_cast<std::size_t>(n)] != corners[v]) ++n;
            if (n == labels) values[static_cast<std::size_t>(labels++)] = corners[v];
            label[v] = static_cast<std::uint8_t>(n);
        }
        for (std::size_t f = 0; f < 6; ++f) {
            const auto& c = kFaceCorners[f];
            // Only two labels across both diagonals are told apart; all else is the same for any order.
            const bool both = label[c[0]] == label[c[2]] && label[c[1]] == label[c[3]];
            faces = static_cast<std::uint8_t>(faces | unsigned{both && corners[c[0]] < corners[c[1]]} << f);
        }
    }
    std::uint32_t key() const {
        std::uint32_t key = faces;
        for (const std::uint8_t l : label) key = key << 3 | l;
        return key;
    }
};

/// All that follows from that.
struct CellPattern {
    static constexpr std::int8_t kNone = -1;

    explicit CellPattern(const CellCorners& corners);

    std::array<std::uint8_t, 8> label;  ///< of each corner
    bool single = false;                ///< one point, and no knots that have points
    std::uint8_t joined = 0;   ///< bit f: relaxation joins the point with that behind face f; 0: it stays
    std::vector<NetPoint> at;  ///< the points of patches first
    std::array<std::int8_t, 6> point_of_face;  ///< that of the crossed edges of a face with one knot

    /// What a label's mesh has of the points.
    struct Own {
        std::uint8_t label, number;
    };
    std::vector<Own> owns;
    /// For the label at an edge's lower and upper end its own point there, and its own knot on the cell's lower face along an
    /// axis: places in `owns`, kNone.
    std::array<std::array<std::int8_t, 2>, kCellEdges> own_of_edge;
    std::array<std::array<std::array<std::int8_t, 2>, kCellEdges>, 3> own_of_knot;

    /// By label: its quads in a slice of samples are a quarter of the sum over the cells above it. Each of a quad's four
    /// cells counts one, or where only two of them are in that slice of cells, two.
    std::array<std::uint8_t, 8> quarters{};
    /// The labels that have a triangle more, as a knot lies beside an edge; by the edge's slice.
    std::array<std::vector<std::uint8_t>, 2> knot_triangles;
};

/// The patterns that were met.
class CellPatterns {
  public:
    /// Stays where it is.
    const CellPattern& of(const CellCorners& corners);

  private:
    std::unordered_map<std::uint32_t, std::unique_ptr<CellPattern>> patterns_;
};

/// A cell with two labels and one point.
struct PlainCase {
    NetPoint at;
    std::uint8_t joined = 0, quarters = 0;  ///< as CellPattern has them; quarters of both labels
};

/// By which corners (bit v - 1: corner v) have another label than corner 0.
const std::array<PlainCase, 128>& plain_cases();

}  // namespace marrow::internal
