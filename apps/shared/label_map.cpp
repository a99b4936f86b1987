// Tells label maps from scans.
#include "label_map.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace marrow::apps {
namespace {

template <class T>
bool is_label(T sample) {
    return sample >= 0 && static_cast<double>(sample) == std::floor(static_cast<double>(sample));
}

// Compares neighbours along x. Noise makes those of a scan differ, while those within a structure of a label
// map are equal.
template <class T>
bool looks_like_labels(const T* samples, std::int64_t nx, std::int64_t rows) {
    constexpr std::int64_t kMostPairs = 4'000'000;
    const std::int64_t step = std::max<std::int64_t>(1, rows * nx / kMostPairs);
    std::int64_t pairs = 0, equal = 0;
    for (std::int64_t row = 0; row < rows; row += step) {
        const T* x = samples + row * nx;
        for (std::int64_t i = 0; i < nx; ++i) {
            if (!is_label(x[i])) return false;
            if (i == 0 || x[i] == 0 || x[i - 1] == 0) continue;
            ++pairs;
            equal += x[i] == x[i - 1];
        }
    }
    return pairs > 0 && equal > pairs / 2;
}

}  // namespace

bool looks_like_label_map(const Volume& volume) {
    if (!volume.rescale().is_identity()) return false;  // labels are not rescaled
    const auto& [nx, ny, nz] = volume.geometry().dims;
    return visit_sample_type(volume.type(), [&, rows = ny * nz, nx = nx]<class T>(T) {
        return looks_like_labels(volume.samples<T>(), nx, rows);
    });
}

}  // namespace marrow::apps
