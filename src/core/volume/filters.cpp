// Filters volumes: crops them, takes medians, and convolves along one axis after the other.
#include <marrow/volume_filters.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>
#include <string>
#include <vector>

#include <marrow/error.h>

#include "base/checked_size.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "checks.h"
#include "rows.h"

namespace marrow {

using namespace internal;

namespace {

using Dims = std::array<std::int64_t, 3>;

std::size_t sample_index(const Dims& dims, std::int64_t x, std::int64_t y, std::int64_t z) {
    return static_cast<std::size_t>((z * dims[1] + y) * dims[0] + x);
}

template <class T>
bool is_nan(T value) {
    return value != value;
}

template <class T>
void median_of_row(const VolumeView& in, std::int64_t radius, std::int64_t y, std::int64_t z, T* out) {
    const Dims& dims = in.geometry.dims;
    std::vector<T> window;
    const auto from = [&](std::int64_t i) { return std::max<std::int64_t>(i - radius, 0); };
    const auto to = [&](std::int64_t i, std::size_t axis) { return std::min(i + radius, dims[axis] - 1); };
    for (std::int64_t x = 0; x < dims[0]; ++x) {
        T& result = out[sample_index(dims, x, y, z)];
        result = row_of<T>(in, y, z)[x];
        if (is_nan(result)) continue;
        window.clear();
        for (std::int64_t k = from(z); k <= to(z, 2); ++k) {
            for (std::int64_t j = from(y); j <= to(y, 1); ++j) {
                const T* const row = row_of<T>(in, j, k);
                for (std::int64_t i = from(x); i <= to(x, 0); ++i) {
                    const T value = row[i];
                    if (!is_nan(value)) window.push_back(value);
                }
            }
        }
        const auto middle = window.begin() + static_cast<std::ptrdiff_t>(window.size() / 2);
        std::nth_element(window.begin(), middle, window.end());
        result = *middle;
    }
}

// One term of the weighted sum that makes a new sample.
struct Tap {
    std::int64_t index;  // of the old sample along the axis
    double weight;
};
using Taps = std::vector<std::vector<Tap>>;  // for each new sample along the axis

// Replaces the samples along an axis by weighted sums of them; the axis gets `count` samples, whose taps
// make_taps returns. It is called when there is memory for the result. A is float or double.
template <class A, class MakeTaps>
Buffer<A> convolve_axis(const Buffer<A>& in, Dims& dims, std::size_t axis, std::int64_t count,
                        const MakeTaps& make_taps, const Progress& progress) {
    const Dims old = dims;
    dims[axis] = count;
    Buffer<A> out(checked_size(static_cast<std::uint64_t>(dims[0] * dims[1] * dims[2]), sizeof(A)));
    const Taps taps = make_taps();
    Stage stage(progress, 0, 1, static_cast<std::size_t>(dims[2]));
    parallel_for(std::int64_t{0}, dims[2], [&](std::int64_t z) {
        std::vector<double> sums(axis == 0 ? 0 : static_cast<std::size_t>(dims[0]));
        for (std::int64_t y = 0; y < dims[1]; ++y) {
            A* const row = out.data() + sample_index(dims, 0, y, z);
            if (axis == 0) {
                const A* const from = in.data() + sample_index(old, 0, y, z);
                for (std::size_t x = 0; x < taps.size(); ++x) {
                    double sum = 0;
                    for (const Tap& tap : taps[x]) sum += tap.weight * static_cast<double>(from[tap.index]);
                    row[x] = static_cast<A>(sum);
                }
                continue;
            }
            // Along y and z, whole rows are added, which vectorises.
            std::fill(sums.begin(), sums.end(), 0.0);
            for (const Tap& tap : taps[static_cast<std::size_t>(axis == 1 ? y : z)]) {
                const A* const from = in.data() + (axis == 1 ? sample_index(old, 0, tap.index, z)
                                                             : sample_index(old, 0, y, tap.index));
                for (std::size_t x = 0; x < sums.size(); ++x)
                    sums[x] += tap.weight * static_cast<double>(from[x]);
            }
            for (std::size_t x = 0; x < sums.size(); ++x) row[x] = static_cast<A>(sums[x]);
        }
        stage.step();
    });
    return out;
}

// The taps of a Gaussian over n samples; sigma is in samples.
Taps gaussian_taps(std::int64_t n, double sigma) {
    Taps taps(static_cast<std::size_t>(n));
    const double reach = std::min(std::ceil(4 * sigma), static_cast<double>(n));
    const auto radius = static_cast<std::int64_t>(reach);
    for (std::int64_t i = 0; i < n; ++i) {
        std::vector<Tap>& own = taps[static_cast<std::size_t>(i)];
        double sum = 0;
        for (std::int64_t j = std::max<std::int64_t>(i - radius, 0); j <= std::min(i + radius, n - 1); ++j) {
            const double distance = static_cast<double>(j - i) / sigma;
            own.push_back({j, std::exp(-0.5 * distance * distance)});
            sum += own.back().weight;
        }
        for (Tap& tap : own) tap.weight /= sum;
    }
    return taps;
}

// Keys' cubic convolution kernel with a = -1/2, |x| <= 2.
double cubic(double x) {
    x = std::abs(x);
    return x <= 1 ? (1.5 * x - 2.5) * x * x + 1 : ((-0.5 * x + 2.5) * x - 4) * x + 2;
}

// Spacings that were float32, and what follows from them, are equal if they differ by less than this part.
constexpr double kSpacingRounding = 1e-6;

// The number of new samples, `step` old ones apart, within n old ones.
std::int64_t resampled_count(std::int64_t n, double step) {
    return static_cast<std::int64_t>(static_cast<double>(n - 1) / step * (1 + kSpacingRounding)) + 1;
}

// The taps that interpolate `count` new samples `step` old ones apart. Beyond the ends the last sample is
// repeated.
Taps cubic_taps(std::int64_t n, std::int64_t count, double step) {
    Taps taps(static_cast<std::size_t>(count));
    for (std::int64_t i = 0; i < count; ++i) {
        double position = static_cast<double>(i) * step;
        const double nearest = std::round(position);
        if (std::abs(position - nearest) <= kSpacingRounding * std::max(nearest, 1.0)) position = nearest;
        const double below = std::floor(position), fraction = position - below;
        for (std::int64_t offset = -1; offset <= 2; ++offset) {
            const double weight =
                fraction == 0 ? (offset == 0) : cubic(static_cast<double>(offset) - fraction);
            if (weight == 0) continue;
            const auto index = static_cast<std::int64_t>(below) + offset;
            taps[static_cast<std::size_t>(i)].push_back({std::clamp<std::int64_t>(index, 0, n - 1), weight});
        }
    }
    return taps;
}

// Converts the samples to their values, as float, or as double where float cannot hold samples, calls
// filter(values, geometry), and returns its result as a volume.
template <class Filter>
Volume in_floating_point(const VolumeView& volume, int threads, Filter filter) {
    Volume result;
    const auto apply = [&]<class T>(T) {
        constexpr bool kWide = sizeof(T) > 4 || std::is_same_v<T, std::int32_t>;
        using A = std::conditional_t<kWide, double, float>;
        with_threads(threads, [&] {
            const std::size_t count =
                checked_size(static_cast<std::uint64_t>(volume.geometry.sample_count()), sizeof(A));
            const Dims& dims = volume.geometry.dims;
            const Rescale rescale = volume.rescale;
            Buffer<A> samples(count);
            parallel_for(std::int64_t{0}, dims[1] * dims[2], [&](std::int64_t row) {
                const T* const in = row_of<T>(volume, row % dims[1], row / dims[1]);
                for (std::int64_t x = 0; x < dims[0]; ++x)
                    samples[static_cast<std::size_t>(row * dims[0] + x)] =
                        static_cast<A>(rescale.value(static_cast<double>(in[x])));
            });
            Geometry geometry = volume.own_geometry();
            samples = filter(std::move(samples), geometry);
            result = Volume(geometry, sample_type_of<A>());
            std::copy(samples.begin(), samples.end(), result.template samples<A>());
        });
    };
    try {
        visit_sample_type(volume.type, apply);
    } catch (const std::bad_alloc&) {
        throw LimitError("filter: not enough memory; crop or coarsen the volume");
    }
    return result;
}

// Blurs along the three axes. Sigma is in mm.
template <class A>
Buffer<A> blur(Buffer<A> samples, Geometry& g, double sigma, const Progress& progress) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const double begin = static_cast<double>(axis) / 3;
        const std::int64_t n = g.dims[axis];
        const auto taps = [&] { return gaussian_taps(n, sigma / g.spacing[axis]); };
        samples =
            convolve_axis(samples, g.dims, axis, n, taps, sub_progress(progress, begin, begin + 1.0 / 3));
    }
    return samples;
}

// Blurs samples of which some are missing. They weigh nothing: the blurred sums are divided by the blurred
// weights.
template <class A, class IsMissing>
Buffer<A> blur_present(Buffer<A> samples, Geometry& g, double sigma, const Progress& progress,
                       const IsMissing& is_missing) {
    Buffer<A> weights(samples.size());
    std::transform(samples.begin(), samples.end(), weights.begin(), [&](A v) { return A(!is_missing(v)); });
    const Buffer<A> present = weights;
    std::replace_if(samples.begin(), samples.end(), is_missing, A{0});
    samples = blur(std::move(samples), g, sigma, sub_progress(progress, 0, 0.5));
    weights = blur(std::move(weights), g, sigma, sub_progress(progress, 0.5, 1));
    for (std::size_t i = 0; i < samples.size(); ++i)
        samples[i] = present[i] > 0 ? samples[i] / weights[i] : std::numeric_limits<A>::quiet_NaN();
    return samples;
}

void check_positive(const char* name, double value) {
    if (!(value > 0) || !std::isfinite(value))
        throw InputError(std::string(name) + " must be a positive number of mm");
}

}  // namespace

Volume crop(const VolumeView& volume, const Dims& first, const Dims& last) {
    check_volume(volume);
    const Geometry g = volume.own_geometry();
    Geometry cropped = g;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        if (first[axis] < 0 || last[axis] >= g.dims[axis] || first[axis] > last[axis])
            throw InputError("crop: samples " + std::to_string(first[axis]) + " to " +
                             std::to_string(last[axis]) + " along axis " + std::to_string(axis) +
                             " are not in the volume, which has 0 to " + std::to_string(g.dims[axis] - 1));
        cropped.dims[axis] = last[axis] - first[axis] + 1;
    }
    cropped.origin = g.physical(
        {static_cast<double>(first[0]), static_cast<double>(first[1]), static_cast<double>(first[2])});
    Volume result(cropped, volume.type);
    result.set_rescale(volume.rescale);
    const std::size_t size = sample_size(volume.type);
    const auto* from = static_cast<const std::byte*>(volume.data);
    const auto offset = [&](std::int64_t y, std::int64_t z) {
        return static_cast<std::size_t>((first[2] + z) * volume.slice_pitch() +
                                        (first[1] + y) * volume.row_pitch() + first[0]);
    };
    auto* to = static_cast<std::byte*>(result.data());
    for (std::int64_t z = 0; z < cropped.dims[2]; ++z) {
        for (std::int64_t y = 0; y < cropped.dims[1]; ++y)
            std::copy_n(from + size * offset(y, z), size * static_cast<std::size_t>(cropped.dims[0]),
                        to + size * sample_index(cropped.dims, 0, y, z));
    }
    return result;
}

Volume crop(const VolumeView& volume, const Box& box) {
    check_volume(volume);
    const Geometry g = volume.own_geometry();
    const Mat3d to_index = inverse(g.index_to_physical());
    Dims first, last;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        if (!(box.lower[axis] <= box.upper[axis]))
            throw InputError("crop: the box's lower end must not lie above its upper end");
        // The least and the greatest index of the box's corners. A side may be at infinity.
        double lowest = 0, highest = 0;
        for (std::size_t r = 0; r < 3; ++r) {
            const double per_mm = to_index[axis][r];
            if (per_mm == 0) continue;
            const auto [least, most] =
                std::minmax({per_mm * (box.lower[r] - g.origin[r]), per_mm * (box.upper[r] - g.origin[r])});
            lowest += least;
            highest += most;
        }
        constexpr double kRounding = 1e-6;  // keeps samples that lie exactly on a side of the box
        const double end = static_cast<double>(g.dims[axis] - 1);
        lowest = std::ceil(std::max(lowest, 0.0) - kRounding);
        highest = std::floor(std::min(highest, end) + kRounding);
        if (!(lowest <= highest)) throw InputError("crop: no sample of the scan lies in the box");
        first[axis] = static_cast<std::int64_t>(lowest);
        last[axis] = static_cast<std::int64_t>(highest);
    }
    return crop(volume, first, last);
}

Volume median_filter(const VolumeView& volume, int radius, const FilterOptions& options) {
    check_volume(volume);
    if (radius < 1 || radius > 16) throw InputError("median: the radius must lie between 1 and 16 samples");
    const Dims& dims = volume.geometry.dims;
    Volume result(volume.own_geometry(), volume.type);
    result.set_rescale(volume.rescale);  // larger samples have larger values
    with_threads(options.threads, [&] {
        visit_sample_type(volume.type, [&]<class T>(T) {
            // A slice with a large window takes long. Work is divided by rows, so that it can be cancelled
            // sooner.
            const std::int64_t rows = dims[1] * dims[2];
            Stage stage(options.progress, 0, 1, static_cast<std::size_t>(rows));
            parallel_for(std::int64_t{0}, rows, [&](std::int64_t row) {
                median_of_row(volume, radius, row % dims[1], row / dims[1], result.samples<T>());
                stage.step();
            });
        });
    });
    return result;
}

Volume gaussian_filter(const VolumeView& volume, double sigma, const FilterOptions& options) {
    check_volume(volume);
    check_positive("blur: the standard deviation", sigma);
    return in_floating_point(volume, options.threads, [&]<class A>(Buffer<A> samples, Geometry& g) {
        const auto is_missing = [](A value) { return !std::isfinite(value); };
        if (std::none_of(samples.begin(), samples.end(), is_missing))
            return blur(std::move(samples), g, sigma, options.progress);
        return blur_present(std::move(samples), g, sigma, options.progress, is_missing);
    });
}

Volume resample_isotropic(const VolumeView& volume, double spacing, const FilterOptions& options) {
    check_volume(volume);
    check_positive("resampling: the spacing", spacing);
    double largest = 1;  // of the numbers of samples in between
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const Geometry& g = volume.geometry;
        const auto before = static_cast<double>(g.dims[axis]), after = before * g.spacing[axis] / spacing;
        if (after > static_cast<double>(1 << 30))
            throw LimitError("resampling: more than 2^30 samples along an axis; use a coarser spacing");
        largest *= std::max(before, after + 1);
    }
    constexpr const char* kOutOfMemory = "resampling: not enough memory; use a coarser spacing";
    if (largest > 0x1p53) throw LimitError(kOutOfMemory);
    return in_floating_point(volume, options.threads, [&]<class A>(Buffer<A> samples, Geometry& g) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const std::int64_t n = g.dims[axis];
            const double step = spacing / g.spacing[axis];
            if (n == 1) continue;
            if (n > 0 && std::abs(step - 1) > kSpacingRounding) {
                const double begin = static_cast<double>(axis) / 3;
                const std::int64_t count = resampled_count(n, step);
                const auto taps = [&] { return cubic_taps(n, count, step); };
                try {
                    samples = convolve_axis(samples, g.dims, axis, count, taps,
                                            sub_progress(options.progress, begin, begin + 1.0 / 3));
                } catch (const std::bad_alloc&) {
                    throw LimitError(kOutOfMemory);
                }
            }
            g.spacing[axis] = spacing;
        }
        report_progress(options.progress, 1);
        return samples;
    });
}

}  // namespace marrow
