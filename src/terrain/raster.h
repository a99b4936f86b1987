/// Reads elevation rasters by GDAL: north up, in metres, rows from south to north.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <gdal.h>

namespace marrow::internal::terrain {

/// A surface has at least one point per sample, and at most 2^32 - 1 points.
inline constexpr double kMostSamples = 4294967295.0;

/// An open raster of heights. Its samples are at the centres of its pixels.
class Raster {
  public:
    /// Called while GDAL reads; returns false to stop it.
    using Continue = std::function<bool()>;

    /// Opens a raster and projects it if necessary. `cell` is TerrainOptions::cell. \throw the errors of
    /// extract_terrain
    Raster(const std::filesystem::path& path, std::optional<double> cell, Continue should_continue = {});

    std::int64_t columns() const { return columns_; }
    std::int64_t rows() const { return rows_; }
    double east_step() const { return east_step_; }    ///< metres between columns
    double north_step() const { return north_step_; }  ///< metres between rows
    double west() const { return west_; }              ///< easting of the first column, metres
    double south() const { return south_; }            ///< northing of the first row, metres
    /// Easting and northing halfway between the first and the last column and row, metres.
    std::array<double, 2> centre() const {
        return {west_ + static_cast<double>(columns_ - 1) * east_step_ / 2,
                south_ + static_cast<double>(rows_ - 1) * north_step_ / 2};
    }

    /// Reads rows [first, first + count), each from west to east, in metres; NaN if unknown.
    /// \throw IoError; Cancelled
    void read(std::int64_t first, std::int64_t count, double* heights) const;

    /// Whether the raster has a georeference; else the steps between its samples are `cell`.
    bool georeferenced() const { return georeferenced_; }
    /// Whether the raster names its coordinate system; else its coordinates are assumed to be metres.
    bool has_coordinate_system() const { return has_coordinate_system_; }
    const std::string& format() const { return format_; }
    const std::string& projection() const { return projection_; }
    const std::vector<std::string>& warnings() const { return warnings_; }

  private:
    struct Close {
        void operator()(void* dataset) const { GDALClose(dataset); }
    };
    using Dataset = std::unique_ptr<void, Close>;

    void open();
    void warn_of_distortion(double distortion);
    void project(const std::string& to, std::optional<double> cell);

    std::string path_;
    std::string name_;  // the path in quotes, for messages
    Continue should_continue_;
    Dataset source_;  // the file
    Dataset warped_;  // the file as it is read, if that differs; destroyed before its source
    GDALDatasetH dataset_ = nullptr;
    std::int64_t columns_ = 0, rows_ = 0;
    double east_step_ = 0, north_step_ = 0, west_ = 0, south_ = 0;
    bool georeferenced_ = false, has_coordinate_system_ = true;
    double height_unit_ = 1, height_scale_ = 1, height_offset_ = 0;
    std::string format_, projection_;
    std::vector<std::string> warnings_;
};

}  // namespace marrow::internal::terrain
