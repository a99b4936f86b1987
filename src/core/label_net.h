/// The points of a label map's surface net: where they are and how they hang together.
///
/// The samples are surrounded by one layer of background; indices (i, j, k) count from there, so sample (x, y, z) is at
/// (x + 1, y + 1, z + 1). Cell (i, j, k) lies between samples (i, j, k) and (i + 1, j + 1, k + 1), and so does the grid edge
/// along an axis from sample (i, j, k): cells and edges have the indices of their lower end.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <marrow/buffer.h>
#include <marrow/mesh.h>
#include <marrow/volume.h>

#include "label_cell.h"
#include "pipeline.h"

namespace marrow::internal {

using Index3 = std::array<std::int64_t, 3>;

/// One bit for each grid edge: whether its ends have different labels; and for each cell: whether it has such edges.
struct BorderBits {
    Index3 dims;                                        ///< samples, without the layer around them
    std::size_t words;                                  ///< 64 indices i each, in a row (j, k)
    std::array<std::vector<std::uint64_t>, 3> crossed;  ///< by axis
    std::vector<std::uint64_t> active;                  ///< of cells

    explicit BorderBits(const Index3& volume_dims);

    std::size_t row(std::int64_t j, std::int64_t k) const {
        return static_cast<std::size_t>(k * (dims[1] + 2) + j) * words;
    }
};

/// The crossed edges of a row of cells.
class CellRow {
  public:
    CellRow(const BorderBits& bits, std::int64_t j, std::int64_t k) : words_(bits.words) {
        for (std::size_t r = 0; r < 4; ++r) x_[r] = &bits.crossed[0][bits.row(j + (r & 1), k + (r >> 1))];
        for (std::size_t r = 0; r < 2; ++r)
            y_[r] = &bits.crossed[1][bits.row(j, k + static_cast<std::int64_t>(r))];
        for (std::size_t r = 0; r < 2; ++r)
            z_[r] = &bits.crossed[2][bits.row(j + static_cast<std::int64_t>(r), k)];
    }
    /// The mask of cell i's crossed edges.
    unsigned mask(std::int64_t i) const {
        const auto w = static_cast<std::size_t>(i >> 6);
        const unsigned b = i & 63;
        const auto one = [&](const std::uint64_t* row) { return static_cast<unsigned>(row[w] >> b & 1); };
        const auto next = [&](const std::uint64_t* row) {
            return b < 63           ? static_cast<unsigned>(row[w] >> (b + 1) & 1)
                   : w + 1 < words_ ? static_cast<unsigned>(row[w + 1] & 1)
                                    : 0u;
        };
        return one(x_[0]) | one(x_[1]) << 1 | one(x_[2]) << 2 | one(x_[3]) << 3 | one(y_[0]) << 4 |
               one(y_[1]) << 5 | one(z_[0]) << 6 | one(z_[1]) << 7 | next(y_[0]) << 8 | next(y_[1]) << 9 |
               next(z_[0]) << 10 | next(z_[1]) << 11;
    }

  private:
    std::size_t words_;
    const std::uint64_t *x_[4], *y_[2], *z_[2];
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
    std::vector<std::uint8_t> is_complex;    ///< by these ids
    std::vector<ComplexCell> complex_cells;  ///< in order of id
    Buffer<Vec3f> points;                    ///< first of active cells, then more of complex ones

    std::uint32_t first_point(std::int64_t i, std::int64_t j, std::int64_t k) const {
        return first_point(i, bits.row(j, k));
    }
    /// The same for cell i of a row, given bits.row.
    std::uint32_t first_point(std::int64_t i, std::size_t row) const {
        const std::size_t word = row + static_cast<std::size_t>(i >> 6);
        const std::uint64_t below = bits.active[word] & ((std::uint64_t{1} << (i & 63)) - 1);
        return before[word] + static_cast<std::uint32_t>(__builtin_popcountll(below));
    }
    /// \pre is_complex[id]
    const ComplexCell& complex_cell(std::uint32_t id) const;
};

/// Reads a label map's samples; beyond it there is background.
template <class T>
struct LabelReader {
    const T* samples;
    Index3 dims;
    T background;

    /// A row of samples, or null beyond the map.
    const T* row(std::int64_t j, std::int64_t k) const {
        const bool within = j >= 1 && j <= dims[1] && k >= 1 && k <= dims[2];
        return within ? samples + ((k - 1) * dims[1] + (j - 1)) * dims[0] : nullptr;
    }
    /// Sample i of such a row.
    T at(const T* row, std::int64_t i) const {
        return row != nullptr && i >= 1 && i <= dims[0] ? row[i - 1] : background;
    }
};

/// Finds the points. \throw LimitError more than 2^32 - 1
template <class T>
LabelNet make_net(const LabelReader<T>& labels, const Progress& progress);

/// Moves points towards those they are joined with, `passes` times.
void relax(LabelNet& net, int passes, const Progress& progress);

}  // namespace marrow::internal
