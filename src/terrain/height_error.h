/// Measures the distance between the heights of a surface and of a raster.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <marrow/volume.h>

#include "raster.h"

namespace marrow::internal::terrain {

/// Compares the triangles of a terrain with the samples of a raster, strip by strip.
class HeightError {
  public:
    explicit HeightError(const Raster& raster) : raster_(raster) {}

    /// Adds the samples with a northing in [south, north). `corners` are the easting, northing and height of
    /// each triangle's corners, in metres; triangles that face down are ignored. \pre the strips do not
    /// overlap \throw IoError; Cancelled
    void add_strip(double south, double north, std::vector<Vec3d> corners);

    double rms() const;
    double max() const { return max_; }

  private:
    // Adds rows [first, end); the corners are in columns and rows.
    void add_rows(std::int64_t first, std::int64_t end, std::span<const Vec3d> corners);

    const Raster& raster_;
    double squares_ = 0, max_ = 0;
    std::int64_t samples_ = 0;
};

}  // namespace marrow::internal::terrain
