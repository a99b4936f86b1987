/// Lists the cells of a slice in which the samples may decide the topology.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include <marrow/buffer.h>

#include "count.h"
#include "inside_bits.h"

namespace marrow::internal {

/// Cells row after row, each row in the order of x.
class CandidateCells {
  public:
    /// The undecided cells of a slice.
    CandidateCells(const InsideBits& bits, std::int64_t slice, std::span<const UndecidedCells> undecided);

    std::size_t size() const { return size_; }
    /// The bit of its first corner in the row.
    std::uint32_t x(std::size_t cell) const { return x_[cell]; }
    /// Of its row, in the slice.
    std::uint32_t y(std::size_t cell) const { return y_[cell]; }
    std::uint8_t cell_case(std::size_t cell) const { return kCaseOfRunning[cases_[cell]]; }

  private:
    static const std::array<std::uint8_t, 256> kCaseOfRunning;

    std::size_t size_ = 0;
    Buffer<std::uint32_t> x_, y_;
    Buffer<std::uint8_t> cases_;  // in the order of kRunningCases
};

}  // namespace marrow::internal
