/// Finds the points of a label map's surface net, and how many points and triangles each label's mesh has.
///
/// Each active cell has a point, and multi-label cells can have more. Each crossed edge has a quad between
/// the points of the four cells around it. The labels at both ends of the edge share the quad. Indices are
/// as in borders.h.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include <marrow/buffer.h>

#include "borders.h"
#include "cell_patterns.h"
#include "label_index.h"

namespace marrow::internal {

/// The labels at the ends of an edge. For a two-label cell: that of corner 0 and the other one.
struct LabelPair {
    LabelIndex lower, upper;

    LabelIndex lesser() const { return std::min(lower, upper); }
    LabelIndex greater() const { return std::max(lower, upper); }

    /// Arrays of pairs hold another 32-bit number for multi-label cells.
    static LabelPair from_number(std::size_t number) {
        return {static_cast<LabelIndex>(number), static_cast<LabelIndex>(number >> 16)};
    }
    std::uint32_t number() const { return lower | std::uint32_t{upper} << 16; }
};

/// A multi-label cell. The extra corners and points of a slab are described at SlabOfCells.
struct MultiLabelCell {
    const CellPattern* pattern;
    std::array<std::int32_t, 3> index;
    std::uint32_t id;            ///< among active cells
    std::uint32_t first_corner;  ///< where its corners begin among the slab's extra corners
    std::uint32_t
        first_extra_point;  ///< where its points after the first begin among the slab's extra points
    std::array<LabelIndex, 8> index_of_label;  ///< of CellPattern::labels
};

/// Some slices of cells, which one thread works on at a time.
struct SlabOfCells {
    static constexpr std::int64_t kSlices = 8;

    std::vector<SurfaceCounts> counts;               ///< by label
    std::vector<std::uint64_t> half_triangles_next;  ///< by label, those that belong to the next slab
    std::vector<MultiLabelCell> multi_label_cells;
    /// Points and corners of the net begin with one for each active cell. The extra ones of multi-label cells
    /// follow, slab by slab: how many this slab has.
    std::uint32_t extra_corners = 0, extra_points = 0;
    /// Where this slab's begin among the extra ones of the net.
    std::uint32_t first_extra_corner = 0, first_extra_point = 0;
};

/// A corner of the quads on both sides of a crossed edge. A two-label cell has one corner for all of its
/// edges. In a multi-label cell each crossed edge has its own corner, and the cell's corner refers to them.
struct QuadCorner {
    NetPoint position;  ///< in physical space
    /// The point in the meshes of the lesser and of the greater label. For a multi-label cell: the first
    /// corner of the cell's edges, and the set of these edges.
    std::array<std::uint32_t, 2> point;
    LabelPair labels;
    std::array<std::uint8_t, 4> junction;  ///< as CellPattern::Corner

    bool is_multi_label_cell() const { return labels.lower == labels.upper; }
    std::uint32_t first_corner() const { return point[0]; }
    std::uint32_t crossed_edges() const { return point[1]; }
};

/// A surface net. Its cells are the active ones, in order of (k, j, i).
struct SurfaceNet {
    BorderBits bits;
    std::vector<std::int64_t> labels = {};  ///< the values of labels, in ascending order
    Buffer<std::uint8_t> cases = {};        ///< by cell: index in two_label_cases(); 0: multi-label cell
    /// By cell: its labels. For a multi-label cell: its number in SlabOfCells::multi_label_cells.
    Buffer<LabelPair> label_pairs = {};
    Buffer<NetPoint> points = {};     ///< by cell, then extra points; filled in by relax()
    Buffer<QuadCorner> corners = {};  ///< by cell, then extra corners; filled in by make_label_meshes()
    std::vector<SlabOfCells> slabs = {};

    std::size_t cell_count() const { return label_pairs.size(); }
    std::size_t point_count() const {
        return cell_count() + slabs.back().first_extra_point + slabs.back().extra_points;
    }
    std::size_t corner_count() const {
        return cell_count() + slabs.back().first_extra_corner + slabs.back().extra_corners;
    }

    static std::int64_t first_slice(std::size_t slab) {
        return static_cast<std::int64_t>(slab) * SlabOfCells::kSlices;
    }
    std::int64_t end_slice(std::size_t slab) const {
        return std::min(first_slice(slab + 1), bits.cell_slices());
    }
    const SlabOfCells& slab_of_slice(std::int64_t k) const {
        return slabs[static_cast<std::size_t>(k / SlabOfCells::kSlices)];
    }
    const MultiLabelCell& multi_label_cell(std::int64_t k, std::uint32_t id) const {
        return slab_of_slice(k).multi_label_cells[label_pairs[id].number()];
    }
    /// The index of a point of a multi-label cell after its first; `number` counts from 1.
    std::size_t extra_point(const SlabOfCells& slab, const MultiLabelCell& cell, std::size_t number) const {
        return cell_count() + slab.first_extra_point + cell.first_extra_point + (number - 1);
    }
};

/// Finds labels and cells. \throw InputError too many labels; LimitError 2^32 - 1 points or more
SurfaceNet make_surface_net(const LabelMap& map, BorderBits bits, const Progress& progress);

}  // namespace marrow::internal
