/// Pass 2: inside bits -> how many points and triangles each row makes.
#pragma once

#include <cstdint>

#include "inside_bits.h"

namespace marrow::internal {

/// A row of samples owns the points on the edges that start at its samples, along x, y and z; a row of cells,
/// those whose first corners are its samples, makes triangles. Writes both counts of the rows [row_begin,
/// row_end).
void count_rows(const InsideBits& bits, std::size_t row_begin, std::size_t row_end, std::uint32_t* points,
                std::uint32_t* triangles) noexcept;

}  // namespace marrow::internal
