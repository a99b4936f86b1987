/// Pass 2: inside bits -> how many points and triangles each row makes.
#pragma once

#include <cstdint>
#include <vector>

#include <marrow/histo_pyramid.h>

#include "inside_bits.h"

namespace marrow::internal {

/// What the rows of a grid make. A row of samples owns the points on the edges that start at its samples,
/// along x, y and z; a row of cells, those whose first corners are its samples, makes triangles.
struct RowCounts {
    explicit RowCounts(std::size_t rows) : points(rows), along_x(rows), along_y(rows), triangles(rows) {}

    std::vector<std::uint32_t> points;     ///< on the edges along x, y and z
    std::vector<std::uint32_t> along_x;    ///< of these, along x
    std::vector<std::uint32_t> along_y;    ///< and along y
    std::vector<std::uint32_t> triangles;  ///< of the row of cells
};

/// Marks the active words of the rows [row_begin, row_end) and counts what the rows make, all but their
/// triangles, for which what is left to subtract is noted.
void count_rows(const InsideBits& bits, std::size_t row_begin, std::size_t row_end, RowCounts& counts,
                ActiveWords& active);

/// Counts the triangles of the rows [row_begin, row_end). \pre count_rows of these, the next row and the next
/// slice
void count_triangles(const InsideBits& bits, std::size_t row_begin, std::size_t row_end,
                     RowCounts& counts) noexcept;

}  // namespace marrow::internal
