/// Lists the cells in which the samples may decide the topology.
#pragma once

#include <cstddef>
#include <cstdint>

#include <marrow/buffer.h>
#include <marrow/volume.h>

#include "count.h"
#include "inside_bits.h"

namespace marrow::internal {

/// The candidates of a slice.
class CandidateCells {
  public:
    std::int64_t slice = 0;
    Buffer<UndecidedCells> words;  ///< of the slice, from count_rows()

    /// Finds `words` again, among the active ones.
    void find_words(const InsideBits& bits, const ActiveWords& active);
    /// Lists the cells of `words`, and asks for their samples: those of a large volume are not in the cache,
    /// and a miss takes longer than a decision.
    void list_cells(const VolumeView& volume, const InsideBits& bits);

    /// How many cells are listed. They have the order of (y, x).
    std::size_t size() const { return size_; }
    /// The row of a cell in its slice.
    std::uint32_t y(std::size_t cell) const { return y_[cell]; }
    /// The bit of its first corner in the row.
    std::uint32_t x(std::size_t cell) const { return x_[cell]; }
    std::uint8_t cell_case(std::size_t cell) const;

  private:
    std::size_t size_ = 0;
    Buffer<std::uint32_t> x_, y_;
    Buffer<std::uint8_t> cases_;  // in the order of kRunningCases
};

}  // namespace marrow::internal
