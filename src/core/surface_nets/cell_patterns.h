/// The shape of a label map's surfaces within one cell, as it follows from the labels of the cell's corners.
///
/// Corners, edges and faces are numbered as in core/grid/cell.h. On each face of the cell, junctions connect
/// crossed edges:
///
///   two or three crossed edges, or four labels   one junction connects all of them
///   two labels, both on a diagonal (a b / b a)   the smaller label is connected: at each corner of the
///                                                larger label, a junction connects the corner's two edges
///   one label on a diagonal (a b / c a)          this label is connected: the two other corners have such
///                                                junctions
///
/// The rule depends on the face alone, so the two cells that share a face agree. The crossed edges that
/// junctions connect, on any face, are a component of the cell's border. Each component has a point. Every
/// label has either no crossed edge or two at a junction, so each edge of a label's surface belongs to two
/// quads.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/grid/cell.h"

namespace marrow::internal {

/// The slice of samples in which an edge begins: 0 the cell's lower one, 1 its upper one.
constexpr std::size_t slice_of_edge(std::size_t e) {
    return kEdgeCorners[e][0] >> 2;
}

/// A position relative to the centre of its cell, in samples. Four numbers are faster than three; the fourth
/// is 0.
struct alignas(16) NetPoint {
    float xyz[4];
};

/// Which corners of a cell have the same label.
struct CellCorners {
    std::array<std::uint8_t, 8> first{};  ///< for each corner, the first corner with the same label
    /// Bit f: face f has two labels, both on a diagonal, and that of its first corner is the smaller one.
    std::uint8_t first_is_smaller = 0;

    /// Labels can be of any type that can be compared and ordered.
    template <class Label>
    explicit CellCorners(const std::array<Label, 8>& labels) {
        // Branches would be mispredicted, so there are none.
        for (std::size_t v = 1; v < 8; ++v) {
            std::size_t same = v;
            for (std::size_t u = v; u-- > 0;) same = labels[u] == labels[v] ? u : same;
            first[v] = static_cast<std::uint8_t>(same);
        }
        for (std::size_t f = 0; f < 6; ++f) {
            const auto& c = kFaceCorners[f];
            const unsigned both = unsigned{first[c[0]] == first[c[2]]} & unsigned{first[c[1]] == first[c[3]]},
                           smaller = unsigned{labels[c[0]] < labels[c[1]]};
            first_is_smaller = static_cast<std::uint8_t>(first_is_smaller | (both & smaller) << f);
        }
    }

    /// A number that differs where patterns differ.
    std::uint32_t key() const {
        std::uint32_t key = first_is_smaller;
        for (std::size_t v = 1; v < 8; ++v) key = key << 3 | first[v];
        return key;
    }
};

/// How much of a label's mesh belongs to a cell, or to several.
struct SurfaceCounts {
    std::uint64_t points = 0;
    /// A quad is two triangles, which are four half triangles. The four cells around an edge along z count
    /// one each. Of the four cells around an edge along x or y, the two above the edge's slice of samples
    /// count two each.
    std::uint64_t half_triangles = 0;

    SurfaceCounts& operator+=(const SurfaceCounts& other) {
        points += other.points;
        half_triangles += other.half_triangles;
        return *this;
    }
};

/// The shape of the surfaces in a cell. Its labels are numbered in the order of their first corners.
struct CellPattern {
    static constexpr std::uint8_t kNone = 0xff;

    struct Label {
        std::uint8_t corner;  ///< the first with this label
        SurfaceCounts counts;
        std::uint64_t half_triangles_next = 0;  ///< half triangles that belong to the next slice of cells
    };
    std::vector<Label> labels;

    /// The points of components come first, then further points (see label_points), then those of junctions.
    std::vector<NetPoint> positions;
    /// Bit f: relaxation moves the first point towards that beyond face f. 0: it does not move the point.
    std::uint8_t neighbours = 0;
    /// By face with one junction, the point of its edges' component; kNone without crossed edges.
    std::array<std::uint8_t, 6> point_of_face;

    /// A point of a label's mesh. Where the surface of a label has several loops of edges in one component,
    /// each loop has its own point at the same position, so that the label's mesh is manifold.
    struct LabelPoint {
        std::uint8_t label, position;
    };
    /// Each edge needs a point for both of its labels, and two more at a junction.
    static constexpr std::size_t kMaxLabelPoints = 4 * kCellEdges;
    std::vector<LabelPoint> label_points;

    /// A corner of the quads of a crossed edge: one for the label at the edge's lower end and one for its
    /// upper end, at the same position.
    struct Corner {
        std::array<std::uint8_t, 2> label, label_point;
        /// By axis: if the lower face along it has two junctions, the corner at the edge's junction is this
        /// many entries after this one, else 0. The fourth number is unused and makes copies faster.
        std::array<std::uint8_t, 4> junction;
    };
    std::vector<Corner> corners;      ///< those of crossed edges by edge, then those of junctions
    std::uint16_t crossed_edges = 0;  ///< bit e: edge e
};

/// Derives the pattern of a cell. \pre not all corners have the same label
CellPattern make_cell_pattern(const CellCorners& corners);

/// Finds the patterns of cells. Each thread needs its own cache; all of them share the patterns.
class CellPatternCache {
  public:
    /// The pattern stays valid for the rest of the program.
    const CellPattern& find(const CellCorners& corners);

  private:
    struct Entry {
        std::uint32_t key;
        const CellPattern* pattern = nullptr;
    };
    std::array<Entry, 1024> entries_;
};

/// The pattern of a two-label cell.
struct TwoLabelCase {
    NetPoint position;
    SurfaceCounts counts;  ///< the same for both labels
    std::uint8_t neighbours = 0;
};

/// The cases of two-label cells. Bit v - 1 of the index: corner v has another label than corner 0.
const std::array<TwoLabelCase, 128>& two_label_cases();

}  // namespace marrow::internal
