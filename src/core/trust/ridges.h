/// Ridges: where a wall that is thinner than the scan can carry has its middle, and how high it is there.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

#include <marrow/thin_walls.h>

#include "core/volume/padding.h"
#include "core/volume/rows.h"
#include "peaks.h"
#include "ridge_normal.h"

namespace marrow::internal {

/// One side of a ridge, along an axis.
struct RidgeSide {
    double lowest = 0;       ///< the lowest sample within reach
    std::int64_t steps = 0;  ///< how many samples away it is; 0: there is no sample
};

/// A sample that may be in the middle of a wall.
struct Ridge {
    RidgeSample sample;
    bool is_sheet;  ///< flat and of much contrast; otherwise it can only be a rim of sheets
};

/// The samples of a volume along its axes.
template <class T>
class RidgeProfile {
  public:
    explicit RidgeProfile(const VolumeView& volume, std::optional<double> padding = {})
        : pitches{1, volume.row_pitch(), volume.slice_pitch()},
          dims_(volume.geometry.dims),
          padding_(volume.rescale, padding),
          volume_(volume) {}

    const T* at(const std::array<std::int64_t, 3>& index) const {
        return row_of<T>(volume_, index[1], index[2]) + index[0];
    }

    /// The side of a sample in the direction of `sign`, which is 1 or -1, along `axis`. Padding is infinitely
    /// low.
    RidgeSide side(const std::array<std::int64_t, 3>& index, std::size_t axis, int sign) const {
        const std::int64_t room = sign < 0 ? index[axis] : dims_[axis] - 1 - index[axis];
        const T* const sample = at(index);
        RidgeSide side;
        for (std::int64_t step = 1; step <= std::min(kReach, room); ++step) {
            const T at_step = sample[sign * step * pitches[axis]];
            const double value = padding_.contains(at_step) ? -std::numeric_limits<double>::infinity()
                                                            : static_cast<double>(at_step);
            if (side.steps == 0 || value < side.lowest) side = {value, step};
        }
        return side;
    }

    const std::array<std::int64_t, 3> pitches;

  private:
    const std::array<std::int64_t, 3> dims_;
    const Padding<T> padding_;
    const VolumeView& volume_;
};

/// Tells which samples are in the middle of a wall that does not clearly reach the isovalue.
template <class T>
class RidgeTest {
  public:
    RidgeTest(const VolumeView& volume, double isovalue, double noise, std::optional<double> padding = {})
        : profile_(volume, padding),
          dims_(volume.geometry.dims),
          isovalue_(isovalue),
          least_contrast_(kLeastInNoise * noise),
          matrix_(volume.geometry.index_to_physical()),
          to_index_(inverse(matrix_)),
          cell_volume_(std::abs(determinant(matrix_))) {}

    /// What every ridge keeps.
    WallLimits limits() const { return {isovalue_, least_contrast_, kRimContrast, kMostContrast}; }

    bool is_inside(const std::array<std::int64_t, 3>& index) const {
        return static_cast<double>(*profile_.at(index)) >= isovalue_;
    }

    /// The ridge at an index, if there is one.
    std::optional<Ridge> operator()(const std::array<std::int64_t, 3>& index) const {
        for (std::size_t a = 0; a < 3; ++a) {
            if (index[a] == 0 || index[a] == dims_[a] - 1) return {};
        }
        const auto value = static_cast<double>(*profile_.at(index));
        const double contrasts[3] = {peak_contrast(index, value, 0), peak_contrast(index, value, 1),
                                     peak_contrast(index, value, 2)};
        if (*std::max_element(contrasts, contrasts + 3) < kRimContrast) return {};
        const std::optional<RidgeNormal> ridge = ridge_normal(hessian(index));
        if (!ridge) return {};
        std::size_t axis = 0;
        double steepest = 0;
        for (std::size_t a = 0; a < 3; ++a) {
            const double along = std::abs(dot(ridge->normal, column(matrix_, a)));
            if (along > steepest) steepest = along, axis = a;
        }
        if (contrasts[axis] < kRimContrast) return {};
        return Ridge{{index, axis, cell_volume_ / steepest},
                     ridge->is_sheet && contrasts[axis] >= kSheetContrast};
    }

  private:
    // Chosen on phantoms and on a head (docs/accuracy.md). The contrast of a wall over its higher side
    // is at least so many standard deviations of the noise, and a part of what it would take to reach
    // the isovalue: the sheet of a wall has more than soft tissue in fat, and the rim may have less,
    // because what it ends at raises its sides. A wall that exceeds the isovalue by less than the last
    // part has holes between the samples.
    static constexpr double kLeastInNoise = 5, kSheetContrast = 0.5, kRimContrast = 0.4, kMostContrast = 1.1;

    // The contrast of a peak along an axis, as a part of what it would take to reach the isovalue; 0: no
    // peak. Of two equal samples, the second is the peak.
    double peak_contrast(const std::array<std::int64_t, 3>& index, double value, std::size_t axis) const {
        const T* const sample = profile_.at(index);
        const std::int64_t pitch = profile_.pitches[axis];
        if (!(static_cast<double>(sample[-pitch]) <= value && static_cast<double>(sample[pitch]) < value))
            return 0;
        const double below = profile_.side(index, axis, -1).lowest;
        if (value - below < least_contrast_) return 0;  // the usual case: a peak of noise
        const double above = profile_.side(index, axis, 1).lowest, higher = std::max(below, above);
        if (std::isinf(below) || std::isinf(above)) return 0;  // it is not known how high the wall is
        const double contrast = value - higher, part = contrast / (isovalue_ - higher);
        return contrast >= least_contrast_ && part < kMostContrast ? part : 0;
    }

    // The second derivatives in physical space.
    Mat3d hessian(const std::array<std::int64_t, 3>& index) const {
        const T* const sample = profile_.at(index);
        const auto value = [&](std::int64_t offset) { return static_cast<double>(sample[offset]); };
        Mat3d h;
        for (std::size_t a = 0; a < 3; ++a) {
            const std::int64_t p = profile_.pitches[a];
            h[a][a] = value(-p) - 2 * value(0) + value(p);
            for (std::size_t b = 0; b < a; ++b) {
                const std::int64_t q = profile_.pitches[b];
                h[a][b] = h[b][a] = (value(p + q) - value(p - q) - value(q - p) + value(-p - q)) / 4;
            }
        }
        Mat3d physical{};
        for (std::size_t r = 0; r < 3; ++r) {
            for (std::size_t c = 0; c < 3; ++c)
                physical[r][c] = dot(column(to_index_, r), h * column(to_index_, c));
        }
        return physical;
    }

    const RidgeProfile<T> profile_;
    const std::array<std::int64_t, 3> dims_;
    const double isovalue_, least_contrast_;
    const Mat3d matrix_, to_index_;
    const double cell_volume_;
};

}  // namespace marrow::internal
