// Tells label maps from scans.
#include "label_map.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <type_traits>

namespace marrow::apps {
namespace {

// Beyond the largest label, floating-point numbers leave out integers.
template <class T>
bool is_label(T sample) {
    if constexpr (std::is_floating_point_v<T>) {
        constexpr auto kLargest = static_cast<T>(std::int64_t{1} << std::numeric_limits<T>::digits);
        return sample >= 0 && sample <= kLargest && sample == std::floor(sample);
    } else {
        return sample >= 0;
    }
}

// Calls f(row) for enough rows of samples.
template <class T, class F>
void for_some_rows(const Volume& volume, const F& f) {
    constexpr std::int64_t kMostPairs = 4'000'000;
    const auto& [nx, ny, nz] = volume.geometry().dims;
    const std::int64_t rows = ny * nz, step = std::max<std::int64_t>(1, rows * nx / kMostPairs);
    for (std::int64_t row = 0; row < rows; row += step)
        f(std::span<const T>(volume.samples<T>() + row * nx, static_cast<std::size_t>(nx)));
}

bool looks_like_label_map(const Volume& volume) {
    if (!volume.rescale().is_identity()) return false;  // labels are not rescaled
    if (!has_equal_neighbours(volume, 0)) return false;
    // All samples count: what is a label map is read as one, and that fails at any other number.
    return visit_sample_type(volume.type(), [&]<class T>(T) {
        const T* const samples = volume.samples<T>();
        return std::all_of(samples, samples + volume.geometry().sample_count(), is_label<T>);
    });
}

}  // namespace

bool is_label_map(const Volume& volume, const SeriesInfo& series) {
    return !series.labels.empty() || (series.modality.empty() && looks_like_label_map(volume));
}

bool has_equal_neighbours(const Volume& volume, std::int64_t background) {
    std::int64_t pairs = 0, equal = 0;
    visit_sample_type(volume.type(), [&]<class T>(T) {
        const T outside = static_cast<T>(background);
        for_some_rows<T>(volume, [&](std::span<const T> row) {
            for (std::size_t i = 1; i < row.size(); ++i) {
                if (row[i] == outside || row[i - 1] == outside) continue;
                ++pairs;
                equal += row[i] == row[i - 1];
            }
        });
    });
    return pairs > 0 && equal > pairs / 2;
}

}  // namespace marrow::apps
