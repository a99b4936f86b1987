/// What cells add to the area and volume of the surfaces that pass through them, for many isovalues at once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <marrow/volume.h>

#include "core/grid/index_to_physical.h"

namespace marrow::internal {

/// For each sample how many of a sweep's isovalues are at most its value, from 0 to kMost: then it is inside the surfaces of
/// those. Rows have a 0 at both ends, for the outside round the volume.
struct Levels {
    static constexpr std::size_t kMost = 127;

    std::int64_t stride;
    std::vector<std::uint8_t> bytes;

    explicit Levels(const std::array<std::int64_t, 3>& dims)
        : stride(dims[0] + 2), bytes(static_cast<std::size_t>(stride * dims[1] * dims[2]), 0) {}
};

/// Sums over cells, one for each isovalue.
struct CellSums {
    explicit CellSums(std::size_t isovalues) : area(isovalues), volume(isovalues), triangles(isovalues) {}
    std::vector<double> area, volume;
    std::vector<std::int64_t> triangles;
};

/// Adds up the cells between slices z and z + 1, for z from -1 to the last slice.
void add_cells(const VolumeView& volume, const IndexToPhysical& to_physical, const Levels& levels,
               std::span<const double> isovalues, std::int64_t z, CellSums& sums);

}  // namespace marrow::internal
