/// The passes of an extraction over a part of a volume.
#pragma once

#include <array>
#include <cstdint>

#include <marrow/histo_pyramid.h>
#include <marrow/isosurface.h>
#include <marrow/mesh.h>
#include <marrow/parts.h>

#include "core/grid/index_to_physical.h"
#include "core/marching_cubes/count.h"
#include "core/marching_cubes/inside_bits.h"

namespace marrow::internal {

/// What part of the whole grid a view has. \throw InputError the view or the options are not valid
PartExtent extent_of(const VolumeView& part, const std::array<std::int64_t, 3>& whole,
                     const IsosurfaceOptions& options);

/// \throw LimitError the keys of a grid of these dims do not fit in 64 bits
void check_key_range(const std::array<std::int64_t, 3>& dims);

/// A part after it was classified and counted.
class PartPasses {
  public:
    /// Classifies and counts. Borrows all arguments. \pre the arguments passed extent_of(), and the part has
    /// cells
    PartPasses(const VolumeView& part, const PartExtent& extent, double isovalue,
               const IsosurfaceOptions& options);

    const InsideBits& bits() const { return bits_; }
    const ActiveWords& active() const { return active_; }
    /// The counts of the rows of bits().
    const RowCounts& rows() const { return rows_; }
    std::uint32_t points_along_z(std::size_t row) const {
        return rows_.points[row] - rows_.along_x[row] - rows_.along_y[row];
    }

    /// Makes points, normals and triangles.
    Mesh emit() const;

  private:
    const VolumeView& part_;
    const double isovalue_;
    const IsosurfaceOptions& options_;
    InsideBits bits_;
    ActiveWords active_;
    RowCounts rows_;
};

/// Whether a part has cells.
inline bool has_cells(const PartExtent& extent) {
    return extent.dims[0] >= 2 && extent.dims[1] >= 2 && extent.dims[2] >= 2;
}

}  // namespace marrow::internal
