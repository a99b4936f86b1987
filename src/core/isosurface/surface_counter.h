/// How many surfaces there are, from inside bits alone.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <marrow/buffer.h>

#include "base/disjoint_sets.h"
#include "core/marching_cubes/inside_bits.h"

namespace marrow::internal {

/// Runs of samples of one kind, and which of them hang together.
class Regions {
  public:
    /// Makes the first `runs` runs regions of their own, from `known` on.
    void add(std::size_t known, std::size_t runs);
    void join(std::size_t a, std::size_t b) {
        if (parents_[a] != parents_[b]) joined_ += unite(parents_, a, b);
    }
    void restart() { joined_ = 0; }
    std::size_t joined() const { return joined_; }

  private:
    Buffer<std::uint32_t> parents_;
    std::size_t joined_ = 0;
};

/// Counts the closed surfaces round a grid's inside samples, for grid after grid in the same memory. Surfaces part space into
/// one region more than there are surfaces, as each of them has an inner and an outer side; and regions are runs of samples that
/// hang together: inside ones along the grid's edges, outside ones across diagonals of faces too (see case_table.h).
class SurfaceCounter {
  public:
    /// \pre bits are those of a closed surface
    std::int64_t count(const InsideBits& bits);

  private:
    void add_row(const InsideBits& bits, std::size_t row);
    template <bool kInside>
    void join_rows(std::size_t row, std::size_t other);
    void join_diagonals(const InsideBits& bits, std::size_t row, std::size_t other, std::size_t beside_row,
                        std::size_t beside_other);
    std::size_t outside_run(std::size_t row, std::int32_t sample) const;

    // A row's borders: 0; where it goes in, where it goes out, and so on; and one sample behind its bits. Outside runs lie from
    // the first of each pair to the second, and inside ones from there to the next pair's first.
    Buffer<std::int32_t> borders_;
    std::vector<std::size_t> first_border_;  // of each row, and all
    Regions inside_, outside_;
};

}  // namespace marrow::internal
