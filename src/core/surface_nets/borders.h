/// Where the labels of a map differ.
///
/// The samples are surrounded by one layer of background; indices (i, j, k) count from there, so sample (x, y, z) is at
/// (x + 1, y + 1, z + 1). Cell (i, j, k) lies between samples (i, j, k) and (i + 1, j + 1, k + 1), and so does the grid edge
/// along an axis from sample (i, j, k): cells and edges have the indices of their lower end.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include <marrow/buffer.h>
#include <marrow/volume.h>

#include "base/parallel.h"

namespace marrow::internal {

using Index3 = std::array<std::int64_t, 3>;

/// A label map's samples; beyond it there is background.
struct LabelMap {
    SampleType type;
    const void* samples;
    Index3 dims;
    std::int64_t background;  ///< a value of the type
};

/// Reads the samples of a map by their type.
template <class T>
struct LabelReader {
    const T* samples;
    Index3 dims;
    T background;

    explicit LabelReader(const LabelMap& map)
        : samples(static_cast<const T*>(map.samples)),
          dims(map.dims),
          background(static_cast<T>(map.background)) {}

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

/// One bit for each grid edge: whether its ends have different labels; and for each cell.
struct BorderBits {
    Index3 dims;                                   ///< samples, without the layer around them
    std::size_t words;                             ///< 64 indices i each, in a row (j, k)
    std::array<Buffer<std::uint64_t>, 3> crossed;  ///< by axis
    Buffer<std::uint64_t> active;                  ///< cells with crossed edges
    Buffer<std::uint64_t> complex;  ///< of them, those with more than two labels or more than one point
    Buffer<std::uint32_t> before;   ///< active cells of the row before each word
    std::vector<std::uint32_t> first_of_row;  ///< active cells before each row, and all

    explicit BorderBits(const Index3& volume_dims);

    /// The number of a row; its words are row_number * words and on.
    std::size_t row_number(std::int64_t j, std::int64_t k) const {
        return static_cast<std::size_t>(k * (dims[1] + 2) + j);
    }
    std::size_t row(std::int64_t j, std::int64_t k) const { return row_number(j, k) * words; }
    std::size_t cells() const { return first_of_row.back(); }
};

/// Finds the bits. Takes a step of the stage for each slice of cells. \throw LimitError 2^32 active cells or more
BorderBits find_borders(const LabelMap& map, Stage& stage);

/// \throw LimitError always
[[noreturn]] void throw_too_many_label_points(std::uint64_t points);

/// The active cells of a row.
struct CellRow {
    const std::uint64_t *active, *complex;
    const std::uint32_t* before;
    std::uint32_t first;

    CellRow(const BorderBits& bits, std::int64_t j, std::int64_t k)
        : active(&bits.active[bits.row(j, k)]),
          complex(&bits.complex[bits.row(j, k)]),
          before(&bits.before[bits.row(j, k)]),
          first(bits.first_of_row[bits.row_number(j, k)]) {}
    /// The number of the cell of word w behind the bits `below`, among all.
    std::uint32_t id(std::size_t w, std::uint64_t below) const {
        return first + before[w] + static_cast<std::uint32_t>(__builtin_popcountll(active[w] & below));
    }
};

/// Those of one word.
struct CellWord {
    std::uint64_t active;
    std::uint32_t first;

    CellWord(const CellRow& row, std::size_t w) : active(row.active[w]), first(row.first + row.before[w]) {}
    std::uint32_t id(std::uint64_t below) const {
        return first + static_cast<std::uint32_t>(__builtin_popcountll(active & below));
    }
};

/// The crossed edges of cells, numbered as in case_table.h: of 64 in a word, or of as many in each of several words.
template <class Bits>
struct CrossedEdges {
    Bits edges[12];

    /// Of cells 64 w and on of row (j, k). Words follow each other across the ends of rows, where no edge is crossed.
    [[gnu::always_inline]] CrossedEdges(const BorderBits& bits, std::int64_t j, std::int64_t k,
                                        std::size_t w) {
        const std::size_t r = bits.row(j, k) + w, next_j = bits.row(j + 1, k) + w,
                          next_k = bits.row(j, k + 1) + w, next_jk = bits.row(j + 1, k + 1) + w;
        const auto load = [](const Buffer<std::uint64_t>& from, std::size_t word) {
            Bits loaded;
            std::memcpy(&loaded, &from[word], sizeof loaded);
            return loaded;
        };
        const auto& [x, y, z] = bits.crossed;
        edges[0] = load(x, r);
        edges[1] = load(x, next_j);
        edges[2] = load(x, next_k);
        edges[3] = load(x, next_jk);
        edges[4] = load(y, r);
        edges[5] = load(y, next_k);
        edges[6] = load(z, r);
        edges[7] = load(z, next_j);
        edges[8] = edges[4] >> 1 | load(y, r + 1) << 63;
        edges[9] = edges[5] >> 1 | load(y, next_k + 1) << 63;
        edges[10] = edges[6] >> 1 | load(z, r + 1) << 63;
        edges[11] = edges[7] >> 1 | load(z, next_j + 1) << 63;
    }
};

}  // namespace marrow::internal
