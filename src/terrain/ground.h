// From heights to surfaces: blocks of columns as density volumes.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <marrow/mesh.h>
#include <marrow/volume.h>

namespace marrow::terrain {

/// The grid that the ground is sampled on. Sample (i, j, k) is i columns to the east and j rows to the north of
/// the first, at height `lowest_layer` + k * `layer`; metres, exaggerated.
struct Grid {
    std::int64_t columns = 0, rows = 0;
    double lowest_layer = 0, layer = 1;
    bool closed = false;  ///< a block with walls round the raster and a bottom
    double bottom = 0;    ///< its height, below the lowest layer

    double height(std::int64_t k) const { return lowest_layer + static_cast<double>(k) * layer; }
    /// The highest layer that is not above a height.
    std::int64_t layer_below(double height) const;
};

/// Some rows of heights, whole from west to east; NaN where unknown.
struct Strip {
    const Grid& grid;
    std::int64_t first_row;
    std::span<const double> heights;

    /// The height of a column; NaN also outside of the raster.
    double operator()(std::int64_t i, std::int64_t j) const;
};

/// Columns [west, east] and rows [south, north] of samples. Neighbours share their border samples, so that
/// their cells neither overlap nor leave a gap. A closed ground has cells round the raster as well: one more
/// column and row on each side, all air.
struct Block {
    std::int64_t west, east, south, north;
};

/// The surface in one block.
struct BlockSurface {
    /// For each point the grid edge that it lies on, where another block or point may lie on it too, else
    /// kOwn.
    std::vector<std::uint64_t> shared;
    std::vector<Vec3d> points;  ///< column, row, height
    std::vector<Triangle> triangles;

    static constexpr std::uint64_t kOwn = ~std::uint64_t{0};
};

/// The largest grid, in columns, rows and layers.
inline constexpr std::int64_t kMostColumns = (1 << 24) - 4, kMostLayers = 16000;

/// Extracts the surface of a block. \pre the strip has its rows, as far as the raster does
BlockSurface extract_block(const Strip& strip, const Block& block);

}  // namespace marrow::terrain
