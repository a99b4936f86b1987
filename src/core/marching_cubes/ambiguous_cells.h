/// The cells whose topology the samples decide, for surfaces with exact topology.
///
/// The inside bits find the few words that may have such cells, and everything else runs as without exact
/// topology. What the samples decide is a function of the eight samples of a cell alone, and so the same for
/// all threads and parts of a volume. It is decided when cells are counted, and kept for emission.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <marrow/buffer.h>
#include <marrow/mesh.h>
#include <marrow/volume.h>

#include "base/parallel.h"
#include "candidate_cells.h"
#include "cell_topology.h"
#include "core/grid/index_to_physical.h"
#include "count.h"
#include "inside_bits.h"

namespace marrow::internal {

/// A cell whose surface is not the one that its inside bits alone would give.
struct AmbiguousCell {
    std::uint32_t x;  ///< the bit of its first corner in the row
    CellTopology topology;
};
static_assert(sizeof(AmbiguousCell) == 8);

/// A row of cells that has ambiguous ones, and what they change.
struct AmbiguousRow {
    std::uint32_t y;             ///< of the row, in its slice
    std::uint32_t cells_end;     ///< in its slice's cells; they begin where those of the row before end
    std::uint32_t inner_points;  ///< of the row's cells
    /// How many triangles the samples add to those that the bits alone give
    /// (modulo 2^32, as there may be fewer).
    std::uint32_t more_triangles;

    friend bool operator==(const AmbiguousRow&, const AmbiguousRow&) = default;
};

class AmbiguousCells {
  public:
    /// Borrows all arguments.
    AmbiguousCells(const VolumeView& volume, double isovalue, const IndexToPhysical& to_physical,
                   const InsideBits& bits)
        : volume_(volume),
          isovalue_(isovalue),
          to_physical_(to_physical),
          bits_(bits),
          slices_(static_cast<std::size_t>(bits.nz)) {}

    /// Counts the rows of a slice as count_rows() does, and finds its ambiguous cells.
    void count(std::int64_t slice, RowCounts& counts, ActiveWords& active);
    /// Adds what the ambiguous cells of a slice change. \pre count_triangles() of all rows
    void add_to(RowCounts& counts, std::int64_t slice) const;

    /// Frees the memory of a slice's cells until find_again(). Its rows stay.
    void forget(std::int64_t slice);
    /// Finds the cells of a slice that were forgotten. `active` is that of count(). Returns whether its rows
    /// are the same as before, as they are unless the samples changed.
    bool find_again(std::int64_t slice, const ActiveWords& active);

    /// Writes the inner points of a row's cells, in the order of x, and their normals unless these are null.
    void emit_points(std::size_t row, std::span<const AmbiguousCell> cells, Vec3f* points,
                     Vec3f* normals) const;
    /// Writes the triangles of a cell with inner points, which have ids from `first_inner` on. The others
    /// have the ids `edge_ids`, by edge. Returns the end of what it wrote.
    std::uint32_t* emit_triangles(std::size_t row, const AmbiguousCell& cell, const std::uint32_t* edge_ids,
                                  std::uint32_t first_inner, std::uint32_t* out) const;

    std::size_t bytes() const;

  private:
    friend class AmbiguousRows;

    struct Slice {
        std::vector<AmbiguousRow> rows;  // in the order of y
        Buffer<AmbiguousCell> cells;     // in the order of (y, x)
    };
    // Adds what the loops of the candidates' cases subtract to `to_subtract`, by row of the slice, unless it
    // is null.
    void decide(CandidateCells& candidates, std::uint32_t* to_subtract);
    template <class T>
    void emit_points_of(std::size_t row, std::span<const AmbiguousCell> cells, Vec3f* points,
                        Vec3f* normals) const;

    const VolumeView& volume_;
    const double isovalue_;
    const IndexToPhysical& to_physical_;
    const InsideBits& bits_;
    std::vector<Slice> slices_;
    PerThread<CandidateCells> candidates_;  // whose memory serves one slice after the other
};

/// Visits the rows that have ambiguous cells, in ascending order.
class AmbiguousRows {
  public:
    /// Begins at the row `from` or after it. There are none if `cells` is null.
    AmbiguousRows(const AmbiguousCells* cells, std::size_t from) : cells_(cells) {
        if (cells != nullptr) find(from);
    }

    /// Goes on to `row` or after it. Returns whether it has ambiguous cells. \pre `row` is
    /// not before that of the last call
    bool reach(std::size_t row) { return row >= row_ && catch_up(row); }
    void advance();

    /// The index of the row in the grid; after the last one, more than that of any row.
    std::size_t row() const { return row_; }
    const AmbiguousRow* operator->() const { return &slice().rows[place_]; }
    /// In the order of x.
    std::span<const AmbiguousCell> cells() const;

  private:
    const AmbiguousCells::Slice& slice() const { return cells_->slices_[slice_]; }
    void find(std::size_t from);
    bool catch_up(std::size_t row);
    // Goes to the next slice that has rows, if those of this one end here.
    void settle();

    const AmbiguousCells* const cells_;
    std::size_t slice_ = 0, place_ = 0;  // the row is rows[place_] of this slice
    std::size_t row_ = std::numeric_limits<std::size_t>::max();
};

}  // namespace marrow::internal
