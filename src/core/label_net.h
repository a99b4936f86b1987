/// The points of a label map's surface net: where they are and how they hang together. Indices are those of label_borders.h.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <marrow/buffer.h>
#include <marrow/mesh.h>

#include "label_borders.h"
#include "label_cell.h"
#include "pipeline.h"

namespace marrow::internal {

/// The crossed edges of a row of cells, 64 cells at a time.
class CellRow {
  public:
    CellRow(const BorderBits& bits, std::int64_t j, std::int64_t k) : words_(bits.words) {
        for (std::size_t r = 0; r < 4; ++r) x_[r] = &bits.crossed[0][bits.row(j + (r & 1), k + (r >> 1))];
        for (std::size_t r = 0; r < 2; ++r) {
            yz_[r] = &bits.crossed[1][bits.row(j, k + static_cast<std::int64_t>(r))];
            yz_[2 + r] = &bits.crossed[2][bits.row(j + static_cast<std::int64_t>(r), k)];
        }
    }
    /// Goes to cells 64 w to 64 w + 63.
    void move_to(std::size_t w) {
        for (std::size_t r = 0; r < 4; ++r) {
            edges_[r] = x_[r][w];
            edges_[4 + r] = yz_[r][w];
            edges_[8 + r] = yz_[r][w] >> 1 | (w + 1 < words_ ? yz_[r][w + 1] << 63 : 0);
        }
    }
    /// The mask of crossed edges of the b-th of them.
    unsigned mask(unsigned b) const {
        std::uint64_t mask = 0;
        for (std::size_t e = 0; e < kCellEdges; ++e) mask |= (edges_[e] >> b & 1) << e;
        return static_cast<unsigned>(mask);
    }

  private:
    std::size_t words_;
    const std::uint64_t *x_[4], *yz_[4];
    std::uint64_t edges_[kCellEdges];
};

/// A cell with several points or with knots that have points.
struct ComplexCell {
    std::uint32_t id = 0;  ///< of its first point; the others are `more`, `more` + 1, ...
    std::uint32_t more = 0;
    std::array<std::uint32_t, 3>
        knots{};  ///< of the lower face along each axis: its two knots' points; 0: none
    CellPatches patches;

    std::uint32_t point(int number) const {
        return number == 0 ? id : more + static_cast<std::uint32_t>(number - 1);
    }
};

/// The points of a net, in index coordinates of the volume (sample (x, y, z) at (x, y, z)).
struct LabelNet {
    BorderBits bits;
    std::vector<std::uint32_t>
        before;  ///< active cells before each word of bits.active; they are the first points' ids
    std::vector<std::uint32_t> complex_number;  ///< by these ids: place in complex_cells and 1, or 0: simple
    std::vector<ComplexCell> complex_cells;     ///< in order of id
    std::vector<std::uint8_t>
        joined;  ///< by these ids: bit f: relaxation joins the point with that behind face f; 0 if complex
    Buffer<Vec3f> points;  ///< first of active cells, then more of complex ones

    /// The first point of the first active cell of a slice or of one after it.
    std::uint32_t first_point_of_slice(std::int64_t k) const { return before[bits.row(0, k)]; }

    bool is_complex(std::uint32_t id) const { return complex_number[id] != 0; }
    /// \pre is_complex(id)
    const ComplexCell& complex_cell(std::uint32_t id) const { return complex_cells[complex_number[id] - 1]; }
};

/// Calls f(id, i) for the active cells of a row, with their first points.
template <class F>
void for_each_active(const LabelNet& net, std::int64_t j, std::int64_t k, const F& f) {
    const std::size_t row = net.bits.row(j, k);
    std::uint32_t id = net.before[row];
    for (std::size_t w = 0; w < net.bits.words; ++w) {
        for (std::uint64_t active = net.bits.active[row + w]; active != 0; active &= active - 1)
            f(id++, static_cast<std::int64_t>(64 * w) + __builtin_ctzll(active));
    }
}

/// The first points of a row's active cells, by their i.
class CellIds {
  public:
    explicit CellIds(const BorderBits& bits) : ids_(64 * bits.words + 1) {}
    void fill(const LabelNet& net, std::int64_t j, std::int64_t k) {
        for_each_active(
            net, j, k, [&](std::uint32_t id, std::int64_t i) { ids_[static_cast<std::size_t>(i + 1)] = id; });
    }
    const std::uint32_t* at(std::int64_t i) const { return ids_.data() + (i + 1); }
    std::uint32_t operator[](std::int64_t i) const { return *at(i); }

  private:
    Buffer<std::uint32_t> ids_;  // from i = -1 on
};

/// Finds the points. \throw LimitError more than 2^32 - 1
template <class T>
LabelNet make_net(const LabelReader<T>& labels, const Progress& progress);

}  // namespace marrow::internal
