/// The passes of an extraction over a part of a volume.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include <marrow/histo_pyramid.h>
#include <marrow/isosurface.h>
#include <marrow/mesh.h>
#include <marrow/parts.h>

#include "core/grid/index_to_physical.h"
#include "core/marching_cubes/ambiguous_cells.h"
#include "core/marching_cubes/count.h"
#include "core/marching_cubes/inside_bits.h"

namespace marrow::internal {

/// What part of the whole grid a view has. \throw InputError the view or the options are not valid
PartExtent extent_of(const VolumeView& part, const std::array<std::int64_t, 3>& whole,
                     const IsosurfaceOptions& options);

/// \throw InputError always
[[noreturn]] void throw_mixed_topology();

/// The points of a row: on edges along x, y and z, and inside cells.
using PointGroups = std::array<std::uint32_t, 4>;
inline constexpr std::size_t kInner = 3;

/// How many of these groups have counts and numbers.
inline std::size_t point_group_count(bool topology) {
    return topology ? 4 : 3;
}

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
    PointGroups points_of_row(std::size_t row) const {
        const std::uint32_t x = rows_.along_x[row], y = rows_.along_y[row];
        const std::uint32_t inner = inner_points_.empty() ? 0 : inner_points_[row];
        return {x, y, rows_.points[row] - x - y - inner, inner};
    }
    /// Null without exact topology.
    const AmbiguousCells* ambiguous() const { return ambiguous_ ? &*ambiguous_ : nullptr; }

    /// Makes points, normals and triangles.
    Mesh emit() const;

  private:
    void add_ambiguous_cells();

    const VolumeView& part_;
    const double isovalue_;
    const IsosurfaceOptions& options_;
    const IndexToPhysical to_physical_;
    InsideBits bits_;
    ActiveWords active_;
    RowCounts rows_;
    std::optional<AmbiguousCells> ambiguous_;
    std::vector<std::uint32_t> inner_points_;  // of each row, or empty without exact topology
};

/// Whether a part has cells.
inline bool has_cells(const PartExtent& extent) {
    return extent.dims[0] >= 2 && extent.dims[1] >= 2 && extent.dims[2] >= 2;
}

}  // namespace marrow::internal
