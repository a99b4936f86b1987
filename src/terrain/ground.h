/// Extracts the surface of blocks of heights, as density volumes.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <marrow/mesh.h>
#include <marrow/volume.h>

namespace marrow::internal::terrain {

/// The grid of the density. Sample (i, j, k) is i columns east and j rows north of the first sample, at
/// height `lowest_layer` + k * `layer`. Heights are exaggerated metres.
struct Grid {
    std::int64_t columns = 0, rows = 0;
    double lowest_layer = 0, layer = 1;
    bool closed = false;  ///< with walls around the raster and a bottom
    double bottom = 0;    ///< height of the bottom, below the lowest layer

    double height(std::int64_t k) const { return lowest_layer + static_cast<double>(k) * layer; }
    /// The highest layer at or below a height.
    std::int64_t layer_below(double height) const;
};

/// Complete rows of heights, from west to east; NaN if unknown.
struct Strip {
    const Grid& grid;
    std::int64_t first_row;
    std::span<const double> heights;

    /// The height of a sample; NaN also outside the raster.
    double operator()(std::int64_t i, std::int64_t j) const;
};

/// Columns [west, east] and rows [south, north] of samples. Adjacent blocks share their border samples, so
/// that their cells neither overlap nor leave a gap. A closed ground has one more column or row of air on
/// each side of the raster.
struct Block {
    std::int64_t west, east, south, north;
};

/// The surface in one block.
struct BlockSurface {
    /// For each point, the name of its grid edge if another block may have the same point, else kOwn.
    std::vector<std::uint64_t> shared;
    std::vector<Vec3d> points;  ///< column, row, height
    std::vector<Triangle> triangles;

    static constexpr std::uint64_t kOwn = ~std::uint64_t{0};
};

/// The largest grid, in columns, rows and layers.
inline constexpr std::int64_t kMostColumns = (1 << 24) - 4, kMostLayers = 16000;
/// The largest height, in layers. Up to it, rounding moves a height by far less than a layer; far above it,
/// adjacent layers would have the same height, and the search for the layer below would not end.
inline constexpr double kMostHeight = 0x1p40;

/// Extracts the surface of a block. \pre the strip has its rows, as far as the raster does
BlockSurface extract_block(const Strip& strip, const Block& block);

}  // namespace marrow::internal::terrain
