/// Terrain from elevation rasters. Not part of marrow.h: link marrow::terrain, which needs GDAL.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <marrow/export.h>
#include <marrow/mesh.h>
#include <marrow/progress.h>

namespace marrow {

/// How thick a base can be, in lengths of the model: beyond, float coordinates blur the ground.
inline constexpr double kMostTerrainBase = 10;

struct TerrainOptions {
    double cell = 0;        ///< metres between samples, in the plan and upwards; 0: the raster's own
    double exaggerate = 1;  ///< heights are multiplied by this
    std::optional<double> base =
        {};  ///< mm below the lowest ground, at most 10 times the length: a closed block
    std::optional<double> size =
        {};                  ///< mm, the model's longer side; absent: true size, one metre is 1000 mm
    int threads = 0;         ///< threads to use; 0: all
    Progress progress = {};  ///< called while extracting
};

/// What an elevation raster held, and how close the surface came to it.
struct TerrainInfo {
    std::string format;                         ///< as GDAL names it: "USGSDEM", "GTiff", ...
    bool georeferenced = true;                  ///< else `cell` of the options is the distance of its samples
    std::string projection;                     ///< of the plan; empty where the raster does not say
    std::array<std::int64_t, 2> samples{0, 0};  ///< that the surface was made of, eastwards and northwards
    std::array<double, 3> cell{0, 0, 0};        ///< metres between them, and between layers
    std::array<double, 2> centre{0, 0};         ///< easting and northing of the mesh's x = y = 0, in metres
    double lowest = 0, highest = 0;             ///< metres
    std::int64_t unknown_samples = 0;           ///< without a height; the surface has a hole there
    double mm_per_metre = 1000;                 ///< the model's scale
    /// Heights of the surface against those of the raster at its own resolution, in metres before
    /// exaggeration: root mean square and largest difference over all its samples that the surface covers.
    double rms_error = 0, max_error = 0;
    std::vector<std::string> warnings;  ///< one line each
};

/// Turns an elevation raster into a surface: x to the east, y to the north, z up, the raster's centre at x = y
/// = 0, in mm. z = 0 is the height 0 of the raster, or with `base` the bottom of the block.
///
/// Read: GeoTIFF, USGS DEM, SRTM .hgt, DTED, Arc/Info ASCII and float grids, ERDAS Imagine, and PNG height
/// maps, whose `cell` must be given. Rasters in degrees, or turned against the north, are projected to UTM.
///
/// The ground fills a density volume, inside where height - z >= 0, which is extracted by marching cubes over
/// the histogram pyramid in blocks of columns that share their border samples; a strip of blocks is in memory
/// at a time, the mesh as a whole. Along an edge upwards the density is linear, so the surface goes exactly
/// through the heights of the samples. Blocks name their points by the grid edge that they lie on, so where
/// they meet they share them: the result is that of one volume, bit for bit, whatever the size of blocks and
/// the number of threads. With `base` it is closed, with upright walls round the border and half-way to
/// unknown samples; without it is open there.
///
/// \throw IoError a missing or unreadable file; InputError not an elevation raster, no known height, or
/// options out of range; GeometryError a raster without georeference and no `cell`; LimitError more than 2^32 -
/// 1 points, before any height is read where the samples alone are as many, or 16000 layers; Cancelled, also while GDAL reads.
/// The mesh is empty where no four samples side by side have heights and it is not closed.
MARROW_EXPORT Mesh extract_terrain(const std::filesystem::path& raster, const TerrainOptions& options = {},
                                   TerrainInfo* info = nullptr);

/// How many surfaces there can be, each at half the resolution of the one before and the first with `cell` as in TerrainOptions,
/// so that the last still has 2 x 2 samples; nothing where the raster does not say where its samples are. \throw as
/// extract_terrain, of which no height is read
MARROW_EXPORT std::optional<int> most_terrain_levels(const std::filesystem::path& raster, double cell = 0);

}  // namespace marrow
