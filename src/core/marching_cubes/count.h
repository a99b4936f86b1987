/// Pass 2: counts the points and triangles that each row makes, from the inside bits.
#pragma once

#include <cstdint>
#include <vector>

#include <marrow/buffer.h>
#include <marrow/histo_pyramid.h>

#include "inside_bits.h"

namespace marrow::internal {

/// The output of each row of the grid. A row of samples makes the points on the edges along x, y and z that
/// start at its samples. A row of cells makes their triangles; it has the index of the row of its first
/// corners.
struct RowCounts {
    explicit RowCounts(std::size_t rows) : points(rows), along_x(rows), along_y(rows), triangles(rows) {}

    std::vector<std::uint32_t> points;     ///< points on edges along all three axes
    std::vector<std::uint32_t> along_x;    ///< those of them on edges along x
    std::vector<std::uint32_t> along_y;    ///< those of them on edges along y
    std::vector<std::uint32_t> triangles;  ///< triangles of the row of cells
};

/// The cells of a word whose topology the samples may decide: those with an ambiguous face, or with two
/// antipodal corners that differ from the other six.
struct UndecidedCells {
    std::uint32_t y;      ///< of the row, in its slice
    std::uint32_t word;   ///< in the row
    std::uint64_t cells;  ///< bit i: the cell that starts at bit i of the word
};

/// Counts the points of the rows [row_begin, row_end) and marks their active words. Does not count triangles
/// yet, because that takes the next rows: `counts.triangles` gets the number that count_triangles()
/// subtracts.
///
/// Unless `undecided` is null, it becomes the list of the words of these rows that have such cells, in
/// ascending order, and their loops are still to be counted: a cell with L loops adds 2 L to the number that
/// is subtracted.
void count_rows(const InsideBits& bits, std::size_t row_begin, std::size_t row_end, RowCounts& counts,
                ActiveWords& active, Buffer<UndecidedCells>* undecided = nullptr);

/// Counts the triangles of the rows [row_begin, row_end). \pre count_rows() of these rows, the next row and
/// the next slice
void count_triangles(const InsideBits& bits, std::size_t row_begin, std::size_t row_end,
                     RowCounts& counts) noexcept;

}  // namespace marrow::internal
