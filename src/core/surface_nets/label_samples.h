/// Checks the samples of a label map.
#pragma once

#include <cmath>
#include <cstdint>
#include <type_traits>

#include <marrow/error.h>
#include <marrow/volume.h>

#include "base/parallel.h"
#include "core/volume/rows.h"

namespace marrow::internal {

/// \throw InputError a sample is not an integer
template <class T>
void check_label_samples(const VolumeView& map) {
    if constexpr (std::is_floating_point_v<T>) {
        constexpr T kLargest =
            sizeof(T) == 4 ? T(1 << 24) : T(std::int64_t{1} << 53);  // beyond it, not every integer exists
        const auto [nx, ny, nz] = map.geometry.dims;
        parallel_for(std::int64_t{0}, ny * nz, [&, nx = nx, ny = ny](std::int64_t row) {
            const T* const samples = row_of<T>(map, row % ny, row / ny);
            for (std::int64_t x = 0; x < nx; ++x) {
                if (!(std::abs(samples[x]) <= kLargest) || std::trunc(samples[x]) != samples[x])
                    throw InputError(
                        "the volume has samples that are not integers, so it is not a label map; give a "
                        "volume in which each structure has one integer value");
            }
        });
    }
}

}  // namespace marrow::internal
