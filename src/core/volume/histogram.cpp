// Counts samples in bins, and finds isovalues by Otsu's method.
#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>
#include <vector>

#include <marrow/error.h>
#include <marrow/histogram.h>

#include "checks.h"
#include "padding.h"
#include "rows.h"

namespace marrow {
namespace {

// Bins samples, which has the same result as binning their values. `lower` and `upper` are samples.
template <class T>
Histogram count_samples(const VolumeView& volume, int bins, std::optional<double> padding) {
    const auto for_each_sample = [&](const auto& f) {
        const auto [nx, ny, nz] = volume.geometry.dims;
        for (std::int64_t z = 0; z < nz; ++z) {
            for (std::int64_t y = 0; y < ny; ++y) {
                const T* const row = internal::row_of<T>(volume, y, z);
                for (std::int64_t x = 0; x < nx; ++x) f(row[x]);
            }
        }
    };
    const internal::Padding<T> outside(volume.rescale, padding);
    T lower = std::numeric_limits<T>::max();
    T upper = std::numeric_limits<T>::lowest();
    std::int64_t non_finite = 0;
    for_each_sample([&](T sample) {
        if (outside.contains(sample)) return;
        if constexpr (std::is_floating_point_v<T>) {
            if (!std::isfinite(sample)) {
                ++non_finite;
                return;
            }
        }
        lower = std::min(lower, sample);
        upper = std::max(upper, sample);
    });
    if (padding && lower >= upper) return count_samples<T>(volume, bins, {});
    Histogram result;
    result.non_finite_samples = non_finite;
    if (lower > upper) return result;  // no sample is finite
    result.lower = static_cast<double>(lower);
    result.upper = static_cast<double>(upper);
    result.counts.assign(static_cast<std::size_t>(bins), 0);

    // Halved, because the range from the lowest to the largest double does not fit in a double.
    const double half_range = result.upper / 2 - result.lower / 2;
    const auto count_of_bin = [&](double value) -> std::int64_t& {
        const double fraction = half_range > 0 ? (value / 2 - result.lower / 2) / half_range : 0;
        return result.counts[static_cast<std::size_t>(std::min(static_cast<int>(fraction * bins), bins - 1))];
    };
    if constexpr (std::is_integral_v<T> && sizeof(T) <= 2) {
        // There are few values, so the bin of each is computed once.
        const int first = lower, values = upper - first + 1;
        if (values <= volume.geometry.sample_count()) {
            std::vector<std::int64_t> count_of_value(static_cast<std::size_t>(values));
            for_each_sample([&](T sample) {
                if (!outside.contains(sample)) ++count_of_value[static_cast<std::size_t>(sample - first)];
            });
            for (int i = 0; i < values; ++i)
                count_of_bin(first + i) += count_of_value[static_cast<std::size_t>(i)];
            return result;
        }
    }
    for_each_sample([&](T sample) {
        const auto value = static_cast<double>(sample);
        if (std::isfinite(value) && !outside.contains(sample)) ++count_of_bin(value);
    });
    return result;
}

// The first bin that is not padding. The bins after it must hold two values, so that they have a border.
std::size_t first_bin(const Histogram& histogram) {
    constexpr double kLowestHounsfield = -1024;
    const auto& counts = histogram.counts;
    const auto is_occupied = [](std::int64_t count) { return count > 0; };
    const auto bins = static_cast<double>(counts.size());
    const double upper_edge = histogram.lower * (1 - 1 / bins) + histogram.upper / bins;
    const bool alone = counts.size() > 1 && counts[1] == 0;
    const bool may_be_padding = alone && upper_edge <= kLowestHounsfield &&
                                std::count_if(counts.begin() + 1, counts.end(), is_occupied) >= 2;
    return may_be_padding ? 1 : 0;
}

bool has_two_values(const Histogram& histogram) {
    return std::count_if(histogram.counts.begin(), histogram.counts.end(),
                         [](std::int64_t c) { return c > 0; }) >= 2;
}

}  // namespace

Histogram histogram(const VolumeView& volume, int bins, std::optional<double> padding) {
    internal::check_volume(volume);
    if (bins < 2) throw InputError("a histogram needs at least 2 bins");
    Histogram result =
        visit_sample_type(volume.type, [&]<class T>(T) { return count_samples<T>(volume, bins, padding); });
    if (result.counts.empty()) return result;
    result.lower = volume.rescale.value(result.lower);
    result.upper = volume.rescale.value(result.upper);
    return result;
}

double otsu_isovalue(const Histogram& histogram) {
    const auto& counts = histogram.counts;
    if (!has_two_values(histogram))
        throw InputError(
            "all samples have the same value, so Otsu's method finds no isovalue; choose one yourself");

    double all = 0, all_moment = 0;  // moments in units of bins
    const std::size_t begin = first_bin(histogram);
    for (std::size_t i = begin; i < counts.size(); ++i) {
        all += static_cast<double>(counts[i]);
        all_moment += static_cast<double>(counts[i]) * static_cast<double>(i);
    }
    double best = -1;
    std::size_t first = 0, last = 0;  // borders with the best variance; border b is below bin b
    double below = 0, below_moment = 0;
    for (std::size_t border = begin + 1; border < counts.size(); ++border) {
        below += static_cast<double>(counts[border - 1]);
        below_moment += static_cast<double>(counts[border - 1]) * static_cast<double>(border - 1);
        const double above = all - below;
        if (below == 0 || above == 0) continue;
        const double distance = below_moment / below - (all_moment - below_moment) / above;
        const double variance = below * above * distance * distance;
        if (variance > best) {
            best = variance;
            first = border;
        }
        if (variance == best) last = border;
    }
    const double fraction = static_cast<double>(first + last) / 2 / static_cast<double>(counts.size());
    return histogram.lower * (1 - fraction) + histogram.upper * fraction;
}

double otsu_contrast(const Histogram& histogram) {
    if (!has_two_values(histogram)) return 0;
    const double isovalue = otsu_isovalue(histogram), range = histogram.upper - histogram.lower;
    const auto bins = static_cast<double>(histogram.counts.size());
    double count[2] = {0, 0}, moment[2] = {0, 0};
    for (std::size_t i = first_bin(histogram); i < histogram.counts.size(); ++i) {
        const double middle = (static_cast<double>(i) + 0.5) / bins;  // as a fraction of the range
        const bool above = histogram.lower + middle * range >= isovalue;
        count[above] += static_cast<double>(histogram.counts[i]);
        moment[above] += static_cast<double>(histogram.counts[i]) * middle;
    }
    const double contrast = (moment[1] / count[1] - moment[0] / count[0]) * range;
    // The range may overflow, or be too small for its middle to differ from its ends.
    return std::isfinite(contrast) ? contrast : 0;
}

}  // namespace marrow
