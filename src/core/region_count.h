/// How many surfaces there are, from inside bits alone.
#pragma once

#include <cstdint>

#include "inside_bits.h"

namespace marrow::internal {

/// The closed surfaces round a grid's inside samples. They part space into one region more than there are surfaces, as each of
/// them has an inner and an outer side; and regions are runs of samples that hang together: inside ones along the grid's edges,
/// outside ones across diagonals of faces too (see case_table.h). \pre bits are those of a closed surface
std::int64_t count_surfaces(const InsideBits& bits);

}  // namespace marrow::internal
