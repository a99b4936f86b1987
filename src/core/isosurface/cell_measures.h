/// Sums the area, volume and triangles of the surfaces in each cell, for many isovalues at once.
///
/// This is a second marching cubes, on bytes, beside the one on bits in core/marching_cubes. The inside bits
/// belong to one isovalue, so a sweep over bits would read the volume and visit its cells again for each
/// isovalue. Here each sample has one byte, its level, from which the cases of a cell for up to 127 isovalues
/// follow. So every cell is visited once, and no points or triangles are stored.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <marrow/volume.h>

#include "core/grid/index_to_physical.h"

namespace marrow::internal {

/// The level of each sample: how many isovalues of a sweep are at most its value, from 0 to kMost. A sample
/// of level n is inside the surfaces of the n lowest isovalues. Each row has a 0 at both ends, for the
/// outside around the volume.
struct Levels {
    static constexpr std::size_t kMost = 127;

    std::int64_t stride;  // from one row to the next
    std::vector<std::uint8_t> bytes;

    explicit Levels(const std::array<std::int64_t, 3>& dims)
        : stride(dims[0] + 2), bytes(static_cast<std::size_t>(stride * dims[1] * dims[2]), 0) {}
};

/// Sums over the cells of a slice, one for each isovalue.
struct CellMeasures {
    explicit CellMeasures(std::size_t isovalues)
        : twice_area(isovalues), six_volumes(isovalues), facing_z(isovalues), triangles(isovalues) {}
    std::vector<double> twice_area;
    /// The flux of three times (0, 0, z) through the surface, if z is 0 at the slice, and what it grows by if
    /// z is 1/3 there. Kept apart, as z would leave few digits of the positions in their cells.
    std::vector<double> six_volumes, facing_z;
    std::vector<std::int64_t> triangles;
};

/// Adds the measures of the cells between slices z and z + 1 to `sums`, for z from -1 to the last slice. \pre
/// there are at most Levels::kMost isovalues
void add_cells(const VolumeView& volume, const IndexToPhysical& to_physical, const Levels& levels,
               std::span<const double> isovalues, std::int64_t z, CellMeasures& sums);

}  // namespace marrow::internal
