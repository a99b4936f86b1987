/// Map projections of rasters: their names, the UTM zone of a raster, and how far a map's lengths are off.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include <gdal.h>

namespace marrow::internal::terrain {

/// The coordinates of a raster's pixels.
struct PixelGrid {
    std::int64_t columns = 0, rows = 0;
    std::array<double, 6> transform{0, 1, 0, 0, 0, -1};  ///< GDAL's geotransform
    OGRSpatialReferenceH reference = nullptr;            ///< not owned; null: unknown

    std::array<double, 2> at(double column, double row) const {
        const std::array<double, 6>& g = transform;
        return {g[0] + g[1] * column + g[2] * row, g[3] + g[4] * column + g[5] * row};
    }
};

/// The name of a projection; empty if it has none.
std::string projection_name(OGRSpatialReferenceH reference);

/// The UTM zone of a raster's centre, as "EPSG:32633". No value if there is none. \pre the grid has a
/// reference
std::optional<std::string> utm_zone(const PixelGrid& grid);

/// The ratio of a horizontal length on a map to its true length, at the place of a raster and in the
/// direction, east or north, for which it is furthest from 1. 1 also if nothing is known. \pre the grid has a
/// reference
double length_distortion(const PixelGrid& grid, OGRSpatialReferenceH map);

}  // namespace marrow::internal::terrain
