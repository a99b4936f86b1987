/// The cells whose topology the samples decide, for surfaces with exact topology.
///
/// The inside bits find the few words that may have such cells, and everything else runs as without exact
/// topology. What the samples decide is a function of the eight samples of a cell alone, and so the same for all
/// threads and parts of a volume. It is decided when cells are counted. Emission uses what was kept then, or decides
/// again where memory is limited.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <marrow/buffer.h>
#include <marrow/mesh.h>
#include <marrow/volume.h>

#include "cell_topology.h"
#include "core/grid/index_to_physical.h"
#include "count.h"
#include "inside_bits.h"

namespace marrow::internal {

/// A cell whose surface is not the one that its inside bits alone would give.
struct AmbiguousCell {
    std::uint32_t x;      ///< the bit of its first corner in the row
    std::uint16_t shape;  ///< the number of its shape in kShapes
    std::uint8_t cell_case;
    std::uint8_t inner_points;  ///< 1 of a fan, or those of a tunnel
};

/// The ambiguous cells of a grid, as AmbiguousCells::count() found them.
struct KeptCells {
    explicit KeptCells(const InsideBits& bits)
        : of_slice(static_cast<std::size_t>(bits.nz)), row_begin(bits.rows()) {}

    std::vector<std::vector<AmbiguousCell>> of_slice;  ///< in the order of (y, x)
    Buffer<std::uint32_t> row_begin;  ///< where those of each row of cells begin in their slice

    std::size_t bytes() const;
};

class AmbiguousCells {
  public:
    /// Borrows all arguments. count_rows() marks in `words` where the samples may decide something. Unless `kept` is
    /// null, the cells are kept there.
    AmbiguousCells(const VolumeView& volume, double isovalue, const IndexToPhysical& to_physical,
                   const InsideBits& bits, ActiveWords& words, KeptCells* kept)
        : volume_(volume),
          isovalue_(isovalue),
          to_physical_(to_physical),
          bits_(bits),
          words_(words),
          kept_(kept) {}

    /// Counts the inner points and additional triangles of the rows of a slice. Only words with ambiguous cells stay
    /// marked.
    void count(std::int64_t slice, RowCounts& counts) const;

    /// Whether a row of cells has any. \pre count()
    bool has_any(std::size_t row) const {
        const std::uint64_t* masks = words_.row(row);
        std::uint64_t any = 0;
        for (std::size_t m = 0; m < words_.masks_per_row; ++m) any |= masks[m];
        return any != 0;
    }
    /// The cells of a row, in the order of x. They are in `memory` unless they were kept. \pre count()
    std::span<const AmbiguousCell> of_row(std::size_t row, std::vector<AmbiguousCell>& memory) const;
    /// Writes the inner points of a row's cells, in the order of x, and their normals unless these are null.
    /// `memory` is that of of_row().
    void emit_points(std::size_t row, std::vector<AmbiguousCell>& memory, Vec3f* points,
                     Vec3f* normals) const;
    /// Writes the triangles of a cell with inner points, which have ids from `first_inner` on. The others have the ids
    /// `edge_ids`, by edge. Returns the end of what it wrote.
    std::uint32_t* emit_triangles(std::size_t row, const AmbiguousCell& cell, const std::uint32_t* edge_ids,
                                  std::uint32_t first_inner, std::uint32_t* out) const;

  private:
    // A cell with inner points.
    struct InnerCell {
        std::array<std::int64_t, 3> index;
        CellValues values;
        CellTopology topology;
    };

    InnerCell inner_cell(std::size_t row, const AmbiguousCell& cell) const;

    const VolumeView& volume_;
    const double isovalue_;
    const IndexToPhysical& to_physical_;
    const InsideBits& bits_;
    ActiveWords& words_;
    KeptCells* const kept_;
};

}  // namespace marrow::internal
