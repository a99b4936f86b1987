/// Counts the components of a closed surface from inside bits alone.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <marrow/buffer.h>

#include "base/disjoint_sets.h"
#include "core/marching_cubes/inside_bits.h"

namespace marrow::internal {

/// Sets of connected runs. A run is a range of samples along x that are all inside or all outside.
class ConnectedRuns {
  public:
    /// Adds the runs with numbers from `known` to `runs` - 1, each as a set of its own.
    void add(std::size_t known, std::size_t runs);
    void connect(std::size_t a, std::size_t b) {
        if (parents_[a] != parents_[b]) connections_ += unite(parents_, a, b);
    }
    void restart() { connections_ = 0; }
    /// The number of runs minus the number of sets.
    std::size_t connections() const { return connections_; }

  private:
    Buffer<std::uint32_t> parents_;
    std::size_t connections_ = 0;
};

/// Counts the closed surfaces around the inside samples of a grid. It can be used for many grids and keeps
/// its memory.
///
/// Each surface has an inner and an outer side, so n surfaces divide space into n + 1 regions. The regions
/// are sets of connected runs: inside samples are connected along the edges of the grid, outside samples also
/// across the diagonals of faces (see case_table.h).
class SurfaceCounter {
  public:
    /// \pre the bits are those of a closed surface
    std::int64_t count(const InsideBits& bits);

  private:
    void add_row(const InsideBits& bits, std::size_t row);
    template <bool kInside>
    void connect_rows(std::size_t row, std::size_t other);
    void connect_diagonals(const InsideBits& bits, std::size_t row, std::size_t other, std::size_t beside_row,
                           std::size_t beside_other);
    std::size_t outside_run(std::size_t row, std::int32_t sample) const;

    /// For each row: 0; then the samples at which inside runs begin and end, in turn; then the sample after
    /// the end of its bits, plus 1. So outside runs reach from the first to the second element of each pair,
    /// and inside runs from the second to the first of the next pair.
    Buffer<std::int32_t> borders_;
    std::vector<std::size_t> first_border_;  ///< of each row, and the number of all
    ConnectedRuns inside_, outside_;
};

}  // namespace marrow::internal
