/// Finds the grid edges of a label map whose ends have different labels.
///
/// The samples are surrounded by one layer of background, and indices (i, j, k) include this layer: sample
/// (x, y, z) of the map has index (x + 1, y + 1, z + 1). Cell (i, j, k) has samples (i, j, k) to
/// (i + 1, j + 1, k + 1) as its corners. A grid edge has the index of its lower end.
///
/// An edge is crossed if its ends have different labels. A cell is active if one of its edges is crossed. An
/// active cell is a two-label cell if it has two labels, one point, and one junction at most on each face
/// (see cell_patterns.h). All other active cells are multi-label cells.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <marrow/buffer.h>
#include <marrow/progress.h>
#include <marrow/volume.h>

#include "core/grid/cell.h"

namespace marrow::internal {

using Index3 = std::array<std::int64_t, 3>;

/// The samples of a label map.
struct LabelMap {
    SampleType type;
    const void* samples;
    Index3 dims;
    std::int64_t background;  ///< the label around the map; a value of the sample type
};

/// Reads the samples of a map as their own type.
template <class T>
struct LabelReader {
    const T* samples;
    Index3 dims;
    T background;

    explicit LabelReader(const LabelMap& map)
        : samples(static_cast<const T*>(map.samples)),
          dims(map.dims),
          background(static_cast<T>(map.background)) {}

    /// The samples of row (j, k), or null for a row of the layer around the map.
    const T* row(std::int64_t j, std::int64_t k) const {
        const bool within = j >= 1 && j <= dims[1] && k >= 1 && k <= dims[2];
        return within ? samples + ((k - 1) * dims[1] + (j - 1)) * dims[0] : nullptr;
    }
    /// The label at index i of a row that row() returned.
    T label(const T* row, std::int64_t i) const {
        return row != nullptr && i >= 1 && i <= dims[0] ? row[i - 1] : background;
    }
};

/// One bit for each grid edge and two for each cell, 64 to a word, in rows along x.
struct BorderBits {
    Index3 dims;                                   ///< samples, without the layer around them
    std::size_t words;                             ///< words in a row (j, k)
    std::array<Buffer<std::uint64_t>, 3> crossed;  ///< edges, by axis
    Buffer<std::uint64_t> active;                  ///< cells with crossed edges
    Buffer<std::uint64_t> multi_label;             ///< active cells that are not two-label cells
    Buffer<std::uint32_t> cells_before;            ///< for each word, the active cells before it in its row
    std::vector<std::uint32_t> first_cell;         ///< for each row, the active cells before it; last, all

    explicit BorderBits(const Index3& volume_dims);

    std::size_t row(std::int64_t j, std::int64_t k) const {
        return static_cast<std::size_t>(k * (dims[1] + 2) + j);
    }
    std::size_t first_word(std::int64_t j, std::int64_t k) const { return row(j, k) * words; }

    std::int64_t cell_rows() const { return dims[1] + 1; }    ///< rows of cells in a slice
    std::int64_t cell_slices() const { return dims[2] + 1; }  ///< slices of cells
    std::size_t active_cells() const { return first_cell.back(); }
    bool has_active_cells(std::int64_t j, std::int64_t k) const {
        return first_cell[row(j, k)] != first_cell[row(j, k) + 1];
    }
};

/// Finds crossed edges and active cells. \throw LimitError 2^32 - 1 active cells or more
BorderBits find_borders(const LabelMap& map, const Progress& progress);

/// \throw LimitError always
[[noreturn]] void throw_too_many_label_points(std::uint64_t points);

/// The active cells of a word. The id of an active cell is the number of active cells before it, in order of
/// (k, j, i).
struct CellWord {
    std::uint64_t active;
    std::uint32_t first;

    /// The id of the cell at a bit; `below` has all bits below this one.
    std::uint32_t id(std::uint64_t below) const {
        return first + static_cast<std::uint32_t>(std::popcount(active & below));
    }
};

/// The active cells of a row.
struct CellRow {
    const std::uint64_t *active, *multi_label;
    const std::uint32_t* cells_before;
    std::uint32_t first;

    CellRow(const BorderBits& bits, std::int64_t j, std::int64_t k)
        : active(&bits.active[bits.first_word(j, k)]),
          multi_label(&bits.multi_label[bits.first_word(j, k)]),
          cells_before(&bits.cells_before[bits.first_word(j, k)]),
          first(bits.first_cell[bits.row(j, k)]) {}

    CellWord word(std::size_t w) const { return {active[w], first + cells_before[w]}; }
};

/// The crossed edges of a row of cells, numbered as in core/grid/cell.h.
struct CrossedEdges {
    /// The bits of edge e of the cells. For edges at the upper x of their cells, bit i + 1 belongs to cell i.
    std::array<const std::uint64_t*, kCellEdges> bits_of_edge;

    CrossedEdges(const BorderBits& bits, std::int64_t j, std::int64_t k) {
        const std::array<std::size_t, 4> rows = {bits.first_word(j, k), bits.first_word(j + 1, k),
                                                 bits.first_word(j, k + 1), bits.first_word(j + 1, k + 1)};
        for (std::size_t e = 0; e < kCellEdges; ++e)
            bits_of_edge[e] = &bits.crossed[axis_of(e)][rows[kEdgeCorners[e][0] >> 1]];
    }

    static constexpr std::size_t axis_of(std::size_t e) {
        return (kEdgeCorners[e][1] - kEdgeCorners[e][0]) >> 1;  // the corners' numbers differ by 1, 2 or 4
    }
    static constexpr bool is_at_upper_x(std::size_t e) { return (kEdgeCorners[e][0] & 1) != 0; }

    /// Bit b: edge e of cell 64 w + b is crossed. The last word of a row can include the first bit of the
    /// next row, which is 0: no edge along y or z is crossed there.
    std::uint64_t word(std::size_t e, std::size_t w) const {
        const std::uint64_t* const bits = bits_of_edge[e] + w;
        return is_at_upper_x(e) ? bits[0] >> 1 | bits[1] << 63 : bits[0];
    }
};

}  // namespace marrow::internal
