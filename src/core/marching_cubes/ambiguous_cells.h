/// The cells whose topology the samples decide, for surfaces with exact topology.
///
/// The inside bits find the few words that may have such cells, and everything else runs as without exact
/// topology. What the samples decide is a function of the eight samples of a cell alone. So it is asked in every
/// pass instead of stored, and is the same for all threads and parts of a volume.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <marrow/mesh.h>
#include <marrow/volume.h>

#include "cell_topology.h"
#include "core/grid/index_to_physical.h"
#include "count.h"
#include "inside_bits.h"

namespace marrow::internal {

/// A cell whose surface is not the one that its inside bits alone would give.
struct AmbiguousCell {
    std::int64_t x;  ///< the bit of its first corner in the row
    unsigned cell_case;
    CellValues values;
    CellTopology topology;
};

class AmbiguousCells {
  public:
    /// Borrows all arguments. count_rows() marks in `words` where the samples may decide something.
    AmbiguousCells(const VolumeView& volume, double isovalue, const IndexToPhysical& to_physical,
                   const InsideBits& bits, ActiveWords& words)
        : volume_(volume), isovalue_(isovalue), to_physical_(to_physical), bits_(bits), words_(words) {}

    /// Counts the inner points and additional triangles of the rows [row_begin, row_end). Only words with
    /// ambiguous cells stay marked.
    void count(std::size_t row_begin, std::size_t row_end, RowCounts& counts) const;

    /// Whether a row of cells has any. \pre count()
    bool has_any(std::size_t row) const {
        const std::uint64_t* masks = words_.row(row);
        std::uint64_t any = 0;
        for (std::size_t m = 0; m < words_.masks_per_row; ++m) any |= masks[m];
        return any != 0;
    }
    /// Replaces `cells` by those of a row, in the order of x.
    void list(std::size_t row, std::vector<AmbiguousCell>& cells) const;
    /// Writes the inner points of a row's cells, in the order of x, and their normals unless these are null.
    /// `cells` are replaced by those of the row.
    void emit_points(std::size_t row, std::vector<AmbiguousCell>& cells, Vec3f* points, Vec3f* normals) const;
    /// Writes the triangles of a cell whose points have the ids `edge_ids`, by edge, and from `first_inner` on.
    /// Returns the end of what it wrote.
    std::uint32_t* emit_triangles(const AmbiguousCell& cell, const std::uint32_t* edge_ids,
                                  std::uint32_t first_inner, std::uint32_t* out) const;

  private:
    const VolumeView& volume_;
    const double isovalue_;
    const IndexToPhysical& to_physical_;
    const InsideBits& bits_;
    ActiveWords& words_;
};

}  // namespace marrow::internal
