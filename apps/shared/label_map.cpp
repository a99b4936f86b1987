// Tells label maps from scans.
#include "label_map.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

namespace marrow::apps {
namespace {

template <class T>
bool is_label(T sample) {
    return sample >= 0 && static_cast<double>(sample) == std::floor(static_cast<double>(sample));
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

}  // namespace

bool looks_like_label_map(const Volume& volume) {
    if (!volume.rescale().is_identity()) return false;  // labels are not rescaled
    const bool are_labels = visit_sample_type(volume.type(), [&]<class T>(T) {
        bool all = true;
        for_some_rows<T>(volume, [&](std::span<const T> row) {
            all = all && std::all_of(row.begin(), row.end(), is_label<T>);
        });
        return all;
    });
    return are_labels && has_equal_neighbours(volume, 0);
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
