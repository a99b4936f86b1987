// How far a surface's heights are from those of the raster.
#pragma once

#include <cstdint>
#include <span>

#include <marrow/volume.h>

#include "raster.h"

namespace marrow::terrain {

/// Compares triangles of a terrain with the samples of a raster under them, strip by strip.
class HeightError {
  public:
    explicit HeightError(const Raster& raster) : raster_(raster) {}

    /// Adds the samples with a northing in [south, north); each must be in one strip only. `corners` are
    /// easting, northing and height in metres, three a triangle; those not seen from above are left out.
    void add_strip(double south, double north, std::span<const Vec3d> corners);

    double rms() const;
    double max() const { return max_; }

  private:
    const Raster& raster_;
    double squares_ = 0, max_ = 0;
    std::int64_t samples_ = 0;
};

}  // namespace marrow::terrain
