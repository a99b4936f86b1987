// Estimates the noise of a scan from windows in tissue.
#include <marrow/trust.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include <marrow/histogram.h>

#include "base/parallel.h"
#include "core/volume/checks.h"
#include "core/volume/padding.h"
#include "core/volume/rows.h"

namespace marrow {

using namespace internal;

namespace {

constexpr std::int64_t kWindow = 7, kMiddle = kWindow / 2, kMostWindows = 200'000;
constexpr std::size_t kFewestWindows = 30;
// Half of the values of a normal distribution are within 1 / kMadScale standard deviations of its median.
constexpr double kMadScale = 1.4826;

// What the windows of one row of windows say.
struct WindowValues {
    std::vector<double> deviations, slice_differences, laplacians;

    void append(const WindowValues& other) {
        const auto append = [](std::vector<double>& to, const std::vector<double>& from) {
            to.insert(to.end(), from.begin(), from.end());
        };
        append(deviations, other.deviations);
        append(slice_differences, other.slice_differences);
        append(laplacians, other.laplacians);
    }

    // From the unit of samples to that of values.
    void scale(double slope) {
        if (slope == 1) return;
        for (std::vector<double>* differences : {&deviations, &slice_differences, &laplacians}) {
            for (double& difference : *differences) difference *= slope;
        }
    }
};

// The middle of the shortest interval that contains a fifth of the values. It is the mode, also where larger
// values are frequent, as those of windows that contain an edge.
double mode(std::vector<double>& values) {
    std::sort(values.begin(), values.end());
    const std::size_t share = std::max<std::size_t>(values.size() / 5, 1) - 1;
    std::size_t best = 0;
    for (std::size_t i = 0; i + share < values.size(); ++i) {
        if (values[i + share] - values[i] < values[best + share] - values[best]) best = i;
    }
    return (values[best] + values[best + share]) / 2;
}

double median(std::vector<double>& values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

// The standard deviation of normally distributed values with outliers.
double robust_deviation(std::vector<double>& values) {
    const double centre = median(values);
    for (double& value : values) value = std::abs(value - centre);
    return kMadScale * median(values);
}

// Reads the windows of one row of windows, whose first sample row is y. Tissue begins at the sample `lowest`.
template <class T>
WindowValues read_windows(const VolumeView& volume, double lowest, const Padding<T>& padding, std::int64_t y,
                          std::int64_t z) {
    const auto dims = volume.geometry.dims;
    WindowValues values;
    const auto sample = [&](std::int64_t i, std::int64_t j, std::int64_t k) {
        return static_cast<double>(row_of<T>(volume, j, k)[i]);
    };
    const auto is_tissue = [&](T sample) {
        const auto value = static_cast<double>(sample);
        return value >= lowest && std::isfinite(value) && !padding.contains(sample);
    };
    for (std::int64_t x = 0; x + kWindow <= dims[0]; x += kWindow) {
        double sum = 0, squares = 0;
        const double shift = sample(x, y, z);  // keeps the squares small
        bool tissue = std::isfinite(shift);
        for (std::int64_t j = y; j < y + kWindow && tissue; ++j) {
            const T* const row = row_of<T>(volume, j, z) + x;
            for (std::int64_t i = 0; i < kWindow; ++i) {
                const double value = static_cast<double>(row[i]);
                tissue = tissue && is_tissue(row[i]);
                sum += value - shift;
                squares += (value - shift) * (value - shift);
            }
        }
        constexpr double kCount = kWindow * kWindow;
        const double variance = (squares - sum * sum / kCount) / (kCount - 1);
        if (!tissue || !std::isfinite(variance)) continue;  // squares of large doubles overflow
        values.deviations.push_back(std::sqrt(std::max(variance, 0.0)));
        const std::int64_t i = x + kMiddle, j = y + kMiddle;
        const auto second_difference = [&](std::int64_t row) {
            return sample(i - 1, row, z) - 2 * sample(i, row, z) + sample(i + 1, row, z);
        };
        // The squares of the nine weights add up to 36.
        values.laplacians.push_back(
            (second_difference(j - 1) - 2 * second_difference(j) + second_difference(j + 1)) / 6);
        if (z + 1 < dims[2] && is_tissue(row_of<T>(volume, j, z + 1)[i]))
            values.slice_differences.push_back((sample(i, j, z + 1) - sample(i, j, z)) / std::sqrt(2.0));
    }
    return values;
}

// Every stride-th row of every slice_stride-th slice.
VolumeView some_rows(const VolumeView& volume, std::int64_t stride, std::int64_t slice_stride) {
    VolumeView view = volume;
    view.below = view.above = {0, 0, 0};
    auto& dims = view.geometry.dims;
    view.pitch = {volume.row_pitch() * stride, volume.slice_pitch() * slice_stride};
    dims[1] = (dims[1] + stride - 1) / stride;
    dims[2] = (dims[2] + slice_stride - 1) / slice_stride;
    return view;
}

bool has_two_classes(const Histogram& samples) {
    return std::count_if(samples.counts.begin(), samples.counts.end(), [](auto n) { return n > 0; }) >= 2;
}

// The value above which samples are tissue. Without two classes of samples all are.
double tissue_begin(const VolumeView& volume, std::int64_t slice_stride, std::optional<double> padding) {
    constexpr int kBins = 256;
    constexpr std::int64_t kStride = 4;  // the border between two classes needs few samples
    Histogram samples = histogram(some_rows(volume, kStride, slice_stride), kBins, padding);
    if (!has_two_classes(samples)) samples = histogram(volume, kBins, padding);  // those rows may be in air
    return has_two_classes(samples) ? otsu_isovalue(samples) : samples.lower;
}

// Every how many slices windows are read, so that they are not too many.
std::int64_t slice_stride(const std::array<std::int64_t, 3>& dims) {
    const std::int64_t windows = (dims[0] / kWindow) * (dims[1] / kWindow) * dims[2];
    return std::max<std::int64_t>((windows + kMostWindows - 1) / kMostWindows, 1);
}

NoiseEstimate estimate(WindowValues& values) {
    NoiseEstimate noise;
    if (values.deviations.size() < kFewestWindows) return noise;
    noise.windows = static_cast<std::int64_t>(values.deviations.size());
    noise.local_deviation = noise.sigma = noise.lowest = noise.highest = mode(values.deviations);
    const auto include = [&](double value) {
        noise.lowest = std::min(noise.lowest, value);
        noise.highest = std::max(noise.highest, value);
    };
    noise.laplacian = robust_deviation(values.laplacians);
    include(noise.laplacian);
    if (!values.slice_differences.empty()) {
        noise.slices = robust_deviation(values.slice_differences);
        noise.sigma = std::min(noise.sigma, *noise.slices);
        include(*noise.slices);
    }
    return noise;
}

}  // namespace

NoiseEstimate estimate_noise(const VolumeView& volume, const NoiseOptions& options) {
    check_volume(volume);
    const auto dims = volume.geometry.dims;
    const std::int64_t stride = slice_stride(dims);
    const Rescale& rescale = volume.rescale;
    const double lowest = rescale.sample(tissue_begin(volume, stride, options.padding));
    std::vector<WindowValues> by_slice(static_cast<std::size_t>((dims[2] + stride - 1) / stride));
    with_threads(options.threads, [&] {
        Stage stage(options.progress, 0, 1, by_slice.size());
        visit_sample_type(volume.type, [&]<class T>(T) {
            const Padding<T> padding(rescale, options.padding);
            parallel_for(std::size_t{0}, by_slice.size(), [&](std::size_t slice) {
                const std::int64_t z = static_cast<std::int64_t>(slice) * stride;
                for (std::int64_t y = 0; y + kWindow <= dims[1]; y += kWindow)
                    by_slice[slice].append(read_windows<T>(volume, lowest, padding, y, z));
                stage.step();
            });
        });
    });
    WindowValues all;
    for (const WindowValues& values : by_slice) all.append(values);
    all.scale(rescale.slope);
    return estimate(all);
}

}  // namespace marrow
