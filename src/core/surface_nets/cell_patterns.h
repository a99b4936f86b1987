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
#include <vector>

#include "core/grid/case_table.h"

namespace marrow::internal {

/// In which slice of samples an edge begins, above the cell's.
constexpr std::size_t edge_slice(std::size_t e) {
    return kEdgeCorners[e][0] >> 2;
}

/// About the middle of its cell, in samples. Four numbers to a point are as quick as three; the fourth is 0.
struct alignas(16) NetPoint {
    float at[4];
};

/// Which of a cell's corners are alike.
struct CellCorners {
    std::array<std::uint8_t, 8> first{};  ///< the first corner of the same label
    std::uint8_t faces =
        0;  ///< bit f: the label at the first corner of face f is smaller than that at the second

    /// Labels can be compared and ordered.
    template <class Label>
    explicit CellCorners(const std::array<Label, 8>& labels) {
        // Without branches, which would be mispredicted.
        for (std::size_t v = 1; v < 8; ++v) {
            std::size_t same = v;
            for (std::size_t u = v; u-- > 0;) same = labels[u] == labels[v] ? u : same;
            first[v] = static_cast<std::uint8_t>(same);
        }
        for (std::size_t f = 0; f < 6; ++f) {
            const auto& c = kFaceCorners[f];
            // Only two labels across both diagonals are told apart; all else is the same for any order.
            const unsigned both = unsigned{first[c[0]] == first[c[2]]} & unsigned{first[c[1]] == first[c[3]]};
            faces = static_cast<std::uint8_t>(faces | (both & unsigned{labels[c[0]] < labels[c[1]]}) << f);
        }
    }
    std::uint32_t key() const {
        std::uint32_t key = faces;
        for (std::size_t v = 1; v < 8; ++v) key = key << 3 | first[v];
        return key;
    }
};

/// What part of a surface a cell has.
struct SurfaceShare {
    std::uint64_t points = 0;
    /// Of a slice of samples, by the cells above it: a quad is two triangles, and each of its four cells counts a half one, or
    /// where only two of them are in that slice of cells, a whole.
    std::uint64_t half_triangles = 0;

    SurfaceShare& operator+=(const SurfaceShare& other) {
        points += other.points;
        half_triangles += other.half_triangles;
        return *this;
    }
};

/// All that follows from a cell's corners. Its labels are numbered in the order in which they come at corners.
struct CellPattern {
    static constexpr std::int8_t kNone = -1;

    explicit CellPattern(const CellCorners& corners);

    std::uint8_t joined = 0;   ///< bit f: relaxation joins the point with that behind face f; 0: it stays
    std::vector<NetPoint> at;  ///< the points of patches first
    std::array<std::int8_t, 6> point_of_face;  ///< that of the crossed edges of a face with one knot

    /// What a label's mesh has of the points.
    struct Own {
        std::uint8_t label, number;
    };
    /// Both ends of each edge, in a patch and in a knot.
    static constexpr std::size_t kMostOwns = 4 * kCellEdges;
    std::vector<Own> owns;

    /// A corner of the patches of a crossed edge: `owns` of the labels at the edge's lower and upper end, at the same place.
    struct Corner {
        std::array<std::uint8_t, 2> label, own;
        /// By axis: the knot on the cell's lower face along it, so many corners on; 0: where there are no two knots. Four to
        /// be quick.
        std::array<std::uint8_t, 4> knot;
    };
    std::uint16_t crossed = 0;    ///< bit e: edge e
    std::vector<Corner> corners;  ///< of crossed edges, and behind those of knots

    struct Label {
        std::uint8_t corner;  ///< the first that has it
        SurfaceShare share;
        std::uint64_t half_triangles_above = 0;  ///< that belong to the next slice of cells
    };
    std::vector<Label> labels;
};

/// The patterns that were met, each found quickly when it was asked for before.
class CellPatterns {
  public:
    /// Stays for good: what one map's cells are like another's are too.
    const CellPattern& of(const CellCorners& corners);

  private:
    struct Known {
        std::uint32_t key;
        const CellPattern* pattern = nullptr;
    };
    std::array<Known, 1024> known_;
};

/// A cell with two labels and one point, as CellPattern has them.
struct PlainCase {
    NetPoint at;
    SurfaceShare share;  ///< of both labels
    std::uint8_t joined = 0;
};

/// By which corners (bit v - 1: corner v) have another label than corner 0.
const std::array<PlainCase, 128>& plain_cases();

}  // namespace marrow::internal
