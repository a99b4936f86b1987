// Elevation rasters through GDAL: north up, in metres, rows from south to north.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <gdal.h>

namespace marrow::terrain {

/// A surface has a point at least for each sample, and 2^32 - 1 of them at most.
inline constexpr double kMostSamples = 4294967295.0;

/// An opened raster of heights. Its samples are at the centres of its pixels.
class Raster {
  public:
    /// Asked now and then while GDAL reads; false stops it.
    using GoOn = std::function<bool()>;

    /// \throw as extract_terrain. `cell` as in TerrainOptions.
    Raster(const std::filesystem::path& path, double cell, GoOn go_on = {});

    std::int64_t columns() const { return columns_; }
    std::int64_t rows() const { return rows_; }
    double east_step() const { return east_step_; }    ///< metres between columns
    double north_step() const { return north_step_; }  ///< metres between rows
    double west() const { return west_; }              ///< easting of the first column, metres
    double south() const { return south_; }            ///< northing of the first row, metres

    /// Reads rows [first, first + count), each from west to east, in metres; NaN where unknown.
    /// \throw IoError; Cancelled
    void read(std::int64_t first, std::int64_t count, double* heights) const;

    /// Whether the raster says where it is; else its step is the `cell` it was opened with.
    bool placed() const { return placed_; }
    /// Whether it says what its coordinates are; else they are taken for metres.
    bool names_coordinates() const { return names_coordinates_; }
    const std::string& format() const { return format_; }
    const std::string& projection() const { return projection_; }
    const std::vector<std::string>& warnings() const { return warnings_; }

  private:
    struct Close {
        void operator()(void* dataset) const { GDALClose(dataset); }
    };
    using Dataset = std::unique_ptr<void, Close>;

    void project(const std::string& to, double cell);

    std::string name_;
    GoOn go_on_;
    Dataset source_;  // the file
    Dataset warped_;  // the same as it is read, where that differs; goes before its source
    GDALDatasetH dataset_ = nullptr;
    std::int64_t columns_ = 0, rows_ = 0;
    double east_step_ = 0, north_step_ = 0, west_ = 0, south_ = 0;
    bool placed_ = false, names_coordinates_ = true;
    double height_unit_ = 1, height_scale_ = 1, height_offset_ = 0;
    std::string format_, projection_;
    std::vector<std::string> warnings_;
};

}  // namespace marrow::terrain
