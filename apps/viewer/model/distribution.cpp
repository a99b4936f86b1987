// Divides fine counts among the bins on display.
#include "distribution.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace marrow::viewer {
namespace {

constexpr double kFineBins = 1 << 20;

double bin_width(const Histogram& h) {
    return h.upper > h.lower ? (h.upper - h.lower) / static_cast<double>(h.counts.size()) : 1;
}

}  // namespace

bool has_integers(const VolumeView& volume) {
    return volume.type != SampleType::float32 && volume.type != SampleType::float64 &&
           volume.rescale.is_identity();
}

double round_step(double minimum) {
    const double power = std::pow(10, std::floor(std::log10(minimum)));
    for (const double factor : {1.0, 2.0, 5.0}) {
        if (factor * power >= minimum) return factor * power;
    }
    return 10 * power;
}

Distribution::Distribution(const Histogram& histogram)
    : histogram_(histogram), first_(histogram.lower), width_(bin_width(histogram)) {}

Distribution::Distribution(const VolumeView& volume, const Histogram& histogram,
                           std::optional<double> padding) {
    const double range = histogram.upper - histogram.lower;
    integers_ = has_integers(volume) && range < kFineBins;
    // With one bin more than the range, the histogram puts each integer in a bin of its own.
    const double bins = integers_ ? std::max(range + 1, 2.0) : kFineBins;
    histogram_ = marrow::histogram(volume, static_cast<int>(bins), padding);
    first_ = integers_ ? histogram_.lower - 0.5 : histogram_.lower;
    width_ = integers_ ? 1 : bin_width(histogram_);
}

Bins Distribution::bins(double lower, double upper, double count) const {
    Bins result;
    const double finest = (upper - lower) / count;
    if (!std::isfinite(finest) || finest <= 0)
        return {lower, 1, {0}};  // no width for doubles from end to end
    // No bin is shorter than the distance between numbers.
    const double least =
        integers_ ? 1 : std::numeric_limits<double>::epsilon() * std::max(std::abs(lower), std::abs(upper));
    result.width = round_step(std::max(finest, least));
    const double offset = integers_ ? 0.5 : 0;
    const auto index = [&](double value) {
        return static_cast<std::int64_t>(std::floor((value + offset) / result.width));
    };
    const std::int64_t first = index(lower), last = index(upper);
    result.first = static_cast<double>(first) * result.width - offset;
    result.counts.assign(static_cast<std::size_t>(last - first + 1), 0);
    const double end = result.first + result.width * static_cast<double>(result.counts.size());

    const auto fine = [&](double value) {
        return static_cast<std::size_t>(std::clamp(std::floor((value - first_) / width_), 0.0,
                                                   static_cast<double>(histogram_.counts.size())));
    };
    for (std::size_t i = fine(result.first); i < std::min(fine(end) + 1, histogram_.counts.size()); ++i) {
        const double samples = static_cast<double>(histogram_.counts[i]);
        if (samples == 0) continue;
        const double from = first_ + width_ * static_cast<double>(i), to = from + width_;
        for (std::int64_t b = std::max(index(from), first); b <= std::min(index(to), last); ++b) {
            const double left = result.first + result.width * static_cast<double>(b - first);
            const double overlap = std::min(to, left + result.width) - std::max(from, left);
            if (overlap > 0) result.counts[static_cast<std::size_t>(b - first)] += samples * overlap / width_;
        }
    }
    return result;
}

ValueRange usual_range(const Histogram& h) {
    if (h.counts.empty() || h.upper <= h.lower) return {h.lower, h.lower + 1};
    const double all =
        static_cast<double>(std::accumulate(h.counts.begin(), h.counts.end(), std::int64_t{0}));
    const auto tail = [&](auto begin, auto end) {  // bins with at most a thousandth of the samples
        double samples = 0;
        const auto it = std::find_if(begin, end, [&](std::int64_t n) { return (samples += n) > all / 1000; });
        return static_cast<double>(it - begin);
    };
    const double bin = bin_width(h);
    const double lower = h.lower + bin * tail(h.counts.begin(), h.counts.end());
    const double upper = h.upper - bin * tail(h.counts.rbegin(), h.counts.rend());
    if (upper - lower > 0.7 * (h.upper - h.lower)) return {h.lower, h.upper};
    const double margin = 0.1 * (upper - lower);
    return {std::max(lower - margin, h.lower), std::min(upper + margin, h.upper)};
}

}  // namespace marrow::viewer
