/// Where the labels of a map differ.
///
/// The samples are surrounded by one layer of background; indices (i, j, k) count from there, so sample (x, y, z) is at
/// (x + 1, y + 1, z + 1). Cell (i, j, k) lies between samples (i, j, k) and (i + 1, j + 1, k + 1), and so does the grid edge
/// along an axis from sample (i, j, k): cells and edges have the indices of their lower end.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "pipeline.h"

namespace marrow::internal {

using Index3 = std::array<std::int64_t, 3>;

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

/// Sets the bits. Takes a step of the stage for each slice of cells.
template <class T>
void mark_borders(const LabelReader<T>& labels, BorderBits& bits, Stage& stage);

}  // namespace marrow::internal
