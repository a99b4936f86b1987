/// Extracts terrain from elevation rasters. Not part of marrow.h: link marrow::terrain, which needs GDAL.
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

/// The largest TerrainOptions::base, as a multiple of the model's length. A thicker base would blur the
/// ground's float coordinates.
inline constexpr double kMostTerrainBase = 10;

struct TerrainInfo;

struct TerrainOptions {
    /// Metres between samples, horizontally and vertically; not set: the raster's.
    std::optional<double> cell = {};
    double exaggerate = 1;  ///< factor for heights
    /// mm from the bottom of a closed block to the lowest ground; without it the surface is open. At most
    /// kMostTerrainBase times the model's length.
    std::optional<double> base = {};
    std::optional<double> size = {};  ///< mm of the model's longer side; without it 1 metre becomes 1000 mm
    /// What was reported of another level of detail, with the same exaggerate and base: this one then lies on
    /// it, with its centre, scale (instead of size) and bottom. Not owned.
    const TerrainInfo* first_level = nullptr;
    int threads = 0;         ///< threads to use; 0: all
    Progress progress = {};  ///< called while extracting
};

/// What an elevation raster held, and how accurate the surface is.
struct TerrainInfo {
    std::string format;         ///< GDAL's name: "USGSDEM", "GTiff", ...
    bool georeferenced = true;  ///< if not, TerrainOptions::cell gave the spacing of its samples
    std::string projection;     ///< horizontal projection; empty if the raster does not state it
    std::array<std::int64_t, 2> samples{0, 0};  ///< samples of the surface, eastwards and northwards
    std::array<double, 3> cell{0, 0, 0};        ///< metres between samples eastwards, northwards and upwards
    std::array<double, 2> centre{0, 0};         ///< easting and northing at x = y = 0 of the mesh, metres
    double zero = 0;                            ///< height at z = 0 of the mesh, metres
    double lowest = 0, highest = 0;             ///< metres
    std::int64_t unknown_samples = 0;           ///< samples without a height; the surface has holes there
    double mm_per_metre = 1000;                 ///< scale of the model
    /// Root mean square and largest difference between the heights of the surface and of the raster at its
    /// own resolution, over all samples below the surface; metres, before exaggeration.
    double rms_error = 0, max_error = 0;
    std::vector<std::string> warnings;  ///< one line each
};

/// Extracts the surface of an elevation raster: x to the east, y to the north, z up, in mm. The raster's
/// centre is at x = y = 0. z = 0 is height 0, or with TerrainOptions::base the bottom of the block. With
/// TerrainOptions::first_level, both are those of the first level.
///
/// Supported are GeoTIFF, USGS DEM, SRTM .hgt, DTED, Arc/Info ASCII and float grids, ERDAS Imagine, and PNG
/// height maps, which need TerrainOptions::cell. Rasters in degrees are projected to the UTM zone of their
/// centre, and rasters that are rotated against north are turned. A warning says if horizontal lengths in the
/// projection are off by more than 5 %.
///
/// The ground fills a density volume that is inside where height - z >= 0. Marching cubes extracts it in
/// blocks of columns; one strip of blocks and the mesh are in memory, and with a coarser cell the samples
/// that GDAL averages at once, those of 512 x 128 cells. The density is linear along vertical edges, so the
/// surface passes exactly through the samples. The result does not depend on the blocks or on the number of
/// threads. A closed block has vertical walls at the border and halfway to samples without a height; an open
/// surface ends there. The mesh is empty if the surface is open and no four adjacent samples have heights.
///
/// \throw IoError the file is missing or unreadable; InputError it is not an elevation raster, has no
/// heights, or heights of more than 2^40 layers, or an option is out of range; GeometryError it has no
/// georeference and TerrainOptions::cell is not set; LimitError more than 2^32 - 1 points or 16000 layers;
/// Cancelled
MARROW_EXPORT Mesh extract_terrain(const std::filesystem::path& raster, const TerrainOptions& options = {},
                                   TerrainInfo* info = nullptr);

/// The largest number of levels of detail. The first has TerrainOptions::cell, each further one doubles it,
/// and the last still has 2 x 2 samples. No value if the raster has no georeference. No height is read.
/// \throw the errors of extract_terrain
MARROW_EXPORT std::optional<int> most_terrain_levels(const std::filesystem::path& raster,
                                                     std::optional<double> cell = {});

}  // namespace marrow
