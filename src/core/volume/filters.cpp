// Filters of volumes: cut out, median, and sums along one axis after the other.
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <string>
#include <vector>

#include <marrow/volume_filters.h>

#include "base/progress.h"

namespace marrow {

namespace {

// A stage's share of the whole progress.
struct Share {
    double begin, end;
};

// Calls work(i) for each slice, or row, on the threads that are asked for.
template <class Work>
void for_each(std::int64_t count, const FilterOptions& options, Share share, Work work) {
    std::mutex mutex;
    std::int64_t done = 0;
    internal::report_progress(options.progress, share.begin);
    const int most = oneapi::tbb::info::default_concurrency();
    oneapi::tbb::task_arena arena(options.threads > 0 ? std::min(options.threads, most) : most);
    arena.execute([&] {
        oneapi::tbb::parallel_for(std::int64_t{0}, count, [&](std::int64_t i) {
            work(i);
            const std::lock_guard lock(mutex);
            const double fraction = static_cast<double>(++done) / static_cast<double>(count);
            internal::report_progress(options.progress, share.begin + (share.end - share.begin) * fraction);
        });
    });
}

std::size_t at(const std::array<std::int64_t, 3>& dims, std::int64_t x, std::int64_t y, std::int64_t z) {
    return static_cast<std::size_t>((z * dims[1] + y) * dims[0] + x);
}

template <class T>
bool is_nan(T value) {
    return value != value;
}

template <class T>
void median_of_row(const T* in, const std::array<std::int64_t, 3>& dims, std::int64_t radius, std::int64_t y,
                   std::int64_t z, T* out) {
    std::vector<T> window;
    const auto from = [&](std::int64_t i) { return std::max<std::int64_t>(i - radius, 0); };
    const auto to = [&](std::int64_t i, int axis) {
        return std::min(i + radius, dims[static_cast<std::size_t>(axis)] - 1);
    };
    for (std::int64_t x = 0; x < dims[0]; ++x) {
        T& result = out[at(dims, x, y, z)];
        result = in[at(dims, x, y, z)];
        if (is_nan(result)) continue;
        window.clear();
        for (std::int64_t k = from(z); k <= to(z, 2); ++k) {
            for (std::int64_t j = from(y); j <= to(y, 1); ++j) {
                for (std::int64_t i = from(x); i <= to(x, 0); ++i) {
                    const T value = in[at(dims, i, j, k)];
                    if (!is_nan(value)) window.push_back(value);
                }
            }
        }
        const auto middle = window.begin() + static_cast<std::ptrdiff_t>(window.size() / 2);
        std::nth_element(window.begin(), middle, window.end());
        result = *middle;
    }
}

// What a sample along an axis is made of.
struct Tap {
    std::int64_t index;
    double weight;
};
using Taps = std::vector<std::vector<Tap>>;  // for each sample of the result

// Sums samples along an axis, which gets taps.size() of them. A is float or double.
template <class A>
Buffer<A> along_axis(const Buffer<A>& in, std::array<std::int64_t, 3>& dims, std::size_t axis,
                     const Taps& taps, const FilterOptions& options, Share share) {
    const std::array<std::int64_t, 3> old = dims;
    dims[axis] = static_cast<std::int64_t>(taps.size());
    Buffer<A> out(static_cast<std::size_t>(dims[0] * dims[1] * dims[2]));
    for_each(dims[2], options, share, [&](std::int64_t z) {
        for (std::int64_t y = 0; y < dims[1]; ++y) {
            A* const row = out.data() + at(dims, 0, y, z);
            if (axis == 0) {
                const A* const from = in.data() + at(old, 0, y, z);
                for (std::size_t x = 0; x < taps.size(); ++x) {
                    double sum = 0;
                    for (const Tap& tap : taps[x]) sum += tap.weight * static_cast<double>(from[tap.index]);
                    row[x] = static_cast<A>(sum);
                }
                continue;
            }
            std::fill_n(row, dims[0], A{0});
            for (const Tap& tap : taps[static_cast<std::size_t>(axis == 1 ? y : z)]) {
                const A* const from =
                    in.data() + (axis == 1 ? at(old, 0, tap.index, z) : at(old, 0, y, tap.index));
                const auto weight = static_cast<A>(tap.weight);
                for (std::int64_t x = 0; x < dims[0]; ++x) row[x] += weight * from[x];
            }
        }
    });
    return out;
}

Taps gaussian_taps(std::int64_t n, double sigma) {  // sigma in samples
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

// Samples `step` old ones apart. Beyond the ends the last sample is repeated.
Taps cubic_taps(std::int64_t n, double step) {
    constexpr double kRounding = 1e-9;
    const auto count = static_cast<std::int64_t>(static_cast<double>(n - 1) / step + kRounding) + 1;
    Taps taps(static_cast<std::size_t>(count));
    for (std::int64_t i = 0; i < count; ++i) {
        const double place = static_cast<double>(i) * step, whole = std::floor(place + kRounding);
        const double beyond = std::max(place - whole, 0.0);
        for (std::int64_t offset = -1; offset <= 2; ++offset) {
            const double weight =
                beyond < kRounding ? (offset == 0) : cubic(static_cast<double>(offset) - beyond);
            if (weight == 0) continue;
            const auto index = static_cast<std::int64_t>(whole) + offset;
            taps[static_cast<std::size_t>(i)].push_back({std::clamp<std::int64_t>(index, 0, n - 1), weight});
        }
    }
    return taps;
}

// Does `filter` with the samples as float or double, and puts its result in a volume.
template <class Filter>
Volume in_floating_point(const VolumeView& volume, Filter filter) {
    check_geometry(volume.geometry);
    return visit_sample_type(volume.type, [&]<class T>(T) {
        constexpr bool kWide = sizeof(T) > 4 || std::is_same_v<T, std::int32_t>;
        using A = std::conditional_t<kWide, double, float>;
        const auto count = static_cast<std::size_t>(volume.geometry.sample_count());
        const T* const in = static_cast<const T*>(volume.data);
        Buffer<A> samples(count);
        oneapi::tbb::parallel_for(std::size_t{0}, count,
                                  [&](std::size_t i) { samples[i] = static_cast<A>(in[i]); });
        Geometry geometry = volume.geometry;
        samples = filter(std::move(samples), geometry);
        Volume result(geometry, sample_type_of<A>());
        std::copy(samples.begin(), samples.end(), result.template samples<A>());
        return result;
    });
}

void refuse_unless_positive(const char* what, double value) {
    if (!(value > 0) || !std::isfinite(value))
        throw InputError(std::string(what) + " must be a positive number of mm");
}

}  // namespace

Volume crop(const VolumeView& volume, const std::array<std::int64_t, 3>& first,
            const std::array<std::int64_t, 3>& last) {
    const Geometry& g = volume.geometry;
    check_geometry(g);
    Geometry cut = g;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        if (first[axis] < 0 || last[axis] >= g.dims[axis] || first[axis] > last[axis])
            throw InputError("crop: samples " + std::to_string(first[axis]) + " to " +
                             std::to_string(last[axis]) + " along axis " + std::to_string(axis) +
                             " are not in the volume, which has 0 to " + std::to_string(g.dims[axis] - 1));
        cut.dims[axis] = last[axis] - first[axis] + 1;
    }
    cut.origin = g.physical(
        {static_cast<double>(first[0]), static_cast<double>(first[1]), static_cast<double>(first[2])});
    Volume result(cut, volume.type);
    const std::size_t size = sample_size(volume.type);
    const auto* from = static_cast<const std::byte*>(volume.data);
    auto* to = static_cast<std::byte*>(result.data());
    for (std::int64_t z = 0; z < cut.dims[2]; ++z) {
        for (std::int64_t y = 0; y < cut.dims[1]; ++y)
            std::copy_n(from + size * at(g.dims, first[0], first[1] + y, first[2] + z),
                        size * static_cast<std::size_t>(cut.dims[0]), to + size * at(cut.dims, 0, y, z));
    }
    return result;
}

Volume crop(const VolumeView& volume, const Box& box) {
    const Geometry& g = volume.geometry;
    check_geometry(g);
    // The box's corners as indices: the inverse of index -> physical, by Cramer's rule.
    const Mat3d m = g.index_to_physical();
    const auto column = [&](std::size_t a) { return Vec3d{m[0][a], m[1][a], m[2][a]}; };
    const auto cross = [](const Vec3d& a, const Vec3d& b) {
        return Vec3d{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    };
    const auto dot = [](const Vec3d& a, const Vec3d& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
    const double determinant = dot(column(0), cross(column(1), column(2)));
    std::array<std::int64_t, 3> first, last;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        if (!(box.lower[axis] <= box.upper[axis]))
            throw InputError("crop: the box's lower end must not lie above its upper end");
        double lowest = std::numeric_limits<double>::infinity(), highest = -lowest;
        for (int corner = 0; corner < 8; ++corner) {
            Vec3d place;
            for (std::size_t r = 0; r < 3; ++r)
                place[r] = (corner >> r & 1 ? box.upper[r] : box.lower[r]) - g.origin[r];
            const double index =
                dot(place, cross(column((axis + 1) % 3), column((axis + 2) % 3))) / determinant;
            lowest = std::min(lowest, index);
            highest = std::max(highest, index);
        }
        constexpr double kRounding = 1e-6;  // a side through samples takes them in
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
    if (radius < 1 || radius > 16) throw InputError("median: the radius must lie between 1 and 16 samples");
    const Geometry& g = volume.geometry;
    Volume result(g, volume.type);
    visit_sample_type(volume.type, [&]<class T>(T) {
        // By rows, so that one can be stopped: a slice of large windows takes long.
        for_each(g.dims[1] * g.dims[2], options, {0, 1}, [&](std::int64_t row) {
            median_of_row(static_cast<const T*>(volume.data), g.dims, radius, row % g.dims[1],
                          row / g.dims[1], result.samples<T>());
        });
    });
    return result;
}

Volume gaussian_filter(const VolumeView& volume, double sigma, const FilterOptions& options) {
    refuse_unless_positive("blur: the standard deviation", sigma);
    return in_floating_point(volume, [&]<class A>(Buffer<A> samples, Geometry& g) {
        const auto blur = [&](Buffer<A> values, Share share) {
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const double part = (share.end - share.begin) / 3,
                             begin = share.begin + part * static_cast<double>(axis);
                values =
                    along_axis(values, g.dims, axis, gaussian_taps(g.dims[axis], sigma / g.spacing[axis]),
                               options, {begin, begin + part});
            }
            return values;
        };
        const auto is_missing = [](A value) { return !std::isfinite(value); };
        if (std::none_of(samples.begin(), samples.end(), is_missing)) return blur(std::move(samples), {0, 1});
        // Missing samples weigh nothing: the sums are divided by the blurred weights.
        Buffer<A> weights(samples.size());
        std::transform(samples.begin(), samples.end(), weights.begin(),
                       [&](A v) { return A(!is_missing(v)); });
        const Buffer<A> present = weights;
        std::replace_if(samples.begin(), samples.end(), is_missing, A{0});
        samples = blur(std::move(samples), {0, 0.5});
        weights = blur(std::move(weights), {0.5, 1});
        for (std::size_t i = 0; i < samples.size(); ++i)
            samples[i] = present[i] > 0 ? samples[i] / weights[i] : std::numeric_limits<A>::quiet_NaN();
        return samples;
    });
}

Volume resample_isotropic(const VolumeView& volume, double spacing, const FilterOptions& options) {
    refuse_unless_positive("resampling: the spacing", spacing);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const Geometry& g = volume.geometry;
        if (static_cast<double>(g.dims[axis]) * g.spacing[axis] / spacing > static_cast<double>(1 << 30))
            throw LimitError("resampling: more than 2^30 samples along an axis; use a coarser spacing");
    }
    return in_floating_point(volume, [&]<class A>(Buffer<A> samples, Geometry& g) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            if (g.dims[axis] > 0 && g.spacing[axis] != spacing) {
                const double begin = static_cast<double>(axis) / 3;
                try {
                    samples =
                        along_axis(samples, g.dims, axis, cubic_taps(g.dims[axis], spacing / g.spacing[axis]),
                                   options, {begin, begin + 1.0 / 3});
                } catch (const std::bad_alloc&) {
                    throw LimitError("resampling: not enough memory; use a coarser spacing");
                }
            }
            g.spacing[axis] = spacing;
        }
        return samples;
    });
}

}  // namespace marrow
