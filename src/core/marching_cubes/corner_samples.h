/// The samples at the corners of cells.
#pragma once

#include <hwy/base.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

#include <marrow/volume.h>

#include "core/volume/rows.h"
#include "face_signs.h"

namespace marrow::internal {

/// The samples of the cells of a row.
template <class T>
class CornerSamples {
  public:
    CornerSamples() = default;
    CornerSamples(const VolumeView& volume, std::int64_t y, std::int64_t z) : nx_(volume.geometry.dims[0]) {
        const auto [nx, ny, nz] = volume.geometry.dims;
        for (std::size_t r = 0; r < 4; ++r) {
            const std::int64_t row_y = y + static_cast<std::int64_t>(r & 1),
                               row_z = z + static_cast<std::int64_t>(r >> 1);
            const bool within = row_y >= 0 && row_y < ny && row_z >= 0 && row_z < nz;
            rows_[r] = within ? row_of<T>(volume, row_y, row_z) : nullptr;
            all_rows_ &= within;
        }
    }

    /// Minus the isovalue, of the cell that begins at x. NaN where there is no finite sample.
    CellValues minus(double isovalue, std::int64_t x) const {
        CellValues values;
        if (HWY_LIKELY(all_rows_ && x >= 0 && x + 1 < nx_)) {
            double check = 0;  // becomes NaN if a value is not finite
            for (std::size_t v = 0; v < 8; ++v) {
                values[v] =
                    static_cast<double>(rows_[v >> 1][x + static_cast<std::int64_t>(v & 1)]) - isovalue;
                if constexpr (std::is_floating_point_v<T>) check += 0 * values[v];
            }
            if (HWY_LIKELY(check == 0)) return values;
        }
        for (std::size_t v = 0; v < 8; ++v) {
            const std::int64_t at = x + static_cast<std::int64_t>(v & 1);
            const T* const row = rows_[v >> 1];
            values[v] = row != nullptr && at >= 0 && at < nx_ ? difference(row[at], isovalue) : kNan;
        }
        return values;
    }

  private:
    static constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

    // It has the right sign: a rounded difference is 0 only if the exact one is.
    static double difference(T sample, double isovalue) {
        const double result = static_cast<double>(sample) - isovalue;
        if constexpr (std::is_floating_point_v<T>) {
            if (HWY_UNLIKELY(!std::isfinite(result))) {
                constexpr double kMost = std::numeric_limits<double>::max();
                return std::isfinite(sample) ? std::clamp(result, -kMost, kMost) : kNan;
            }
        }
        return result;
    }

    std::int64_t nx_ = 0;
    const T* rows_[4] = {};
    bool all_rows_ = true;
};

}  // namespace marrow::internal
