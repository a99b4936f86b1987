/// Checks the samples of a label map.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <type_traits>

#include <marrow/error.h>
#include <marrow/progress.h>
#include <marrow/volume.h>

#include "base/parallel.h"
#include "core/volume/rows.h"

namespace marrow::internal {

/// The largest label of a floating-point type; beyond it, not every integer exists.
template <class T>
constexpr std::int64_t kLargestLabel = std::int64_t{1} << std::numeric_limits<T>::digits;

/// \throw InputError a sample is not an integer; Cancelled
template <class T>
void check_label_samples(const VolumeView& map, const Progress& progress) {
    if constexpr (std::is_floating_point_v<T>) {
        const auto [nx, ny, nz] = map.geometry.dims;
        Stage stage(progress, 0, 1, static_cast<std::size_t>(nz));
        parallel_for(std::int64_t{0}, nz, [&, nx = nx, ny = ny](std::int64_t z) {
            for (std::int64_t y = 0; y < ny; ++y) {
                const T* const samples = row_of<T>(map, y, z);
                for (std::int64_t x = 0; x < nx; ++x) {
                    if (!(std::abs(samples[x]) <= T(kLargestLabel<T>)) ||
                        std::trunc(samples[x]) != samples[x])
                        throw InputError(
                            "the volume has samples that are not integers, so it is not a label map; give a "
                            "volume in which each structure has one integer value");
                }
            }
            stage.step();
        });
    }
}

}  // namespace marrow::internal
