/// Lists the cells in which the samples may decide the topology: those with an ambiguous face, or with two
/// antipodal corners that differ from the other six.
#pragma once

#include <cstddef>
#include <cstdint>

#include <marrow/buffer.h>

#include "inside_bits.h"

namespace marrow::internal {

/// Cells row after row, each row in the order of x.
class CandidateCells {
  public:
    std::size_t size() const { return size_; }
    /// The bit of its first corner in the row.
    std::uint32_t x(std::size_t cell) const { return x_[cell]; }
    std::uint8_t cell_case(std::size_t cell) const;

    /// Adds the candidates of a row of cells, which are in the words that are marked in its `masks`.
    void add_row(const InsideBits& bits, std::size_t row, const std::uint64_t* masks, std::size_t mask_count);

  private:
    std::size_t size_ = 0;
    Buffer<std::uint32_t> x_;
    Buffer<std::uint8_t> cases_;  // in the order of kRunningCases
};

}  // namespace marrow::internal
