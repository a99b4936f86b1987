// Reports how far isovalue and noise move the points of a surface.
#include <marrow/trust.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <marrow/error.h>
#include <marrow/histogram.h>

#include "base/parallel.h"
#include "core/volume/checks.h"
#include "core/volume/rows.h"

namespace marrow {

using namespace internal;

namespace {

// The cell that contains a position, and the fraction along each axis within it.
struct CellPosition {
    std::array<std::int64_t, 3> cell;
    Vec3d fraction;
};

// The trilinear interpolant of a volume. Positions are indices, and within the grid.
template <class T>
class Interpolant {
  public:
    explicit Interpolant(const VolumeView& volume) : volume_(volume) {}

    CellPosition locate(const Vec3d& index) const {
        CellPosition at;
        for (std::size_t a = 0; a < 3; ++a) {
            const std::int64_t last = std::max<std::int64_t>(volume_.geometry.dims[a] - 2, 0);
            at.cell[a] = std::clamp<std::int64_t>(static_cast<std::int64_t>(index[a]), 0, last);
            at.fraction[a] = index[a] - static_cast<double>(at.cell[a]);
        }
        return at;
    }

    double operator()(const Vec3d& index) const {
        const CellPosition at = locate(index);
        double value = 0;
        for (unsigned corner = 0; corner < 8; ++corner) {
            double weight = 1;
            std::array<std::int64_t, 3> sample = at.cell;
            for (std::size_t a = 0; a < 3; ++a) {
                const bool upper = (corner >> a & 1) != 0;
                weight *= upper ? at.fraction[a] : 1 - at.fraction[a];
                sample[a] += upper;
            }
            if (weight != 0)
                value += weight * static_cast<double>(row_of<T>(volume_, sample[1], sample[2])[sample[0]]);
        }
        return value;
    }

    // The change per sample along each axis: the central difference over one sample,
    // at the border over half of one.
    Vec3d gradient(const Vec3d& index) const {
        Vec3d g{0, 0, 0};
        for (std::size_t a = 0; a < 3; ++a) {
            Vec3d below = index, above = index;
            below[a] = std::max(index[a] - 0.5, 0.0);
            above[a] = std::min(index[a] + 0.5, static_cast<double>(volume_.geometry.dims[a] - 1));
            if (above[a] > below[a]) g[a] = ((*this)(above) - (*this)(below)) / (above[a] - below[a]);
        }
        return g;
    }

    // By how much independent noise of the samples is reduced where they are interpolated.
    double noise_weight(const Vec3d& index) const {
        const CellPosition at = locate(index);
        double squares = 1;
        for (const double t : at.fraction) squares *= (1 - t) * (1 - t) + t * t;
        return std::sqrt(squares);
    }

  private:
    const VolumeView& volume_;
};

// Points are float32 in physical space, so the index of one on the border can be slightly outside.
constexpr double kRounding = 1e-3;

bool is_within(const Vec3d& index, const std::array<std::int64_t, 3>& dims) {
    for (std::size_t a = 0; a < 3; ++a) {
        if (!(index[a] >= -kRounding && index[a] <= static_cast<double>(dims[a] - 1) + kRounding))
            return false;
    }
    return true;
}

TrustPercentiles percentiles(std::vector<float> values, double cap) {
    TrustPercentiles result;
    if (values.empty()) return result;
    result.capped = std::count(values.begin(), values.end(), static_cast<float>(cap));
    const auto percentile = [&](double fraction) {
        const auto rank = static_cast<std::ptrdiff_t>(fraction * static_cast<double>(values.size() - 1));
        std::nth_element(values.begin(), values.begin() + rank, values.end());
        return static_cast<double>(values[static_cast<std::size_t>(rank)]);
    };
    result.median = percentile(0.5);
    result.percentile_90 = percentile(0.9);
    result.percentile_99 = percentile(0.99);
    return result;
}

double largest_spacing(const Mat3d& index_to_physical) {
    double largest = 0;
    for (std::size_t a = 0; a < 3; ++a) largest = std::max(largest, length(column(index_to_physical, a)));
    return largest;
}

double default_step(const VolumeView& volume, std::optional<double> padding) {
    const double step = otsu_contrast(histogram(volume, 256, padding)) / 10;
    return step > 0 ? step : 1;
}

}  // namespace

TrustReport report_trust(const VolumeView& volume, std::span<const Vec3f> points,
                         const TrustOptions& options) {
    check_volume(volume);
    if (options.step && !(*options.step > 0 && std::isfinite(*options.step)))
        throw InputError("options.step must be positive and finite");
    const Geometry geometry = volume.own_geometry();
    const Mat3d matrix = geometry.index_to_physical(), to_index = inverse(matrix);
    TrustReport report;
    report.step = options.step ? *options.step : default_step(volume, options.padding);
    report.cap = largest_spacing(matrix);
    const double estimated = options.noise ? 0 : 0.3;  // the part of the progress
    report.noise = options.noise
                       ? *options.noise
                       : estimate_noise(volume, {.padding = options.padding,
                                                 .threads = options.threads,
                                                 .progress = sub_progress(options.progress, 0, estimated)});
    report.shift.resize(points.size());
    report.noise_shift.resize(points.size());
    constexpr std::size_t kBlock = 4096;
    std::vector<char> within(points.size());
    with_threads(options.threads, [&] {
        Stage stage(options.progress, estimated, 1, (points.size() + kBlock - 1) / kBlock);
        visit_sample_type(volume.type, [&]<class T>(T) {
            const Interpolant<T> interpolant(volume);
            parallel_for(std::size_t{0}, (points.size() + kBlock - 1) / kBlock, [&](std::size_t block) {
                for (std::size_t i = block * kBlock; i < std::min((block + 1) * kBlock, points.size()); ++i) {
                    Vec3d index = to_index * (to_double(points[i]) - geometry.origin);
                    within[i] = is_within(index, geometry.dims);
                    report.shift[i] = report.noise_shift[i] = 0;
                    if (!within[i]) continue;
                    for (std::size_t a = 0; a < 3; ++a)
                        index[a] = std::clamp(index[a], 0.0, static_cast<double>(geometry.dims[a] - 1));
                    const Vec3d g = volume.rescale.slope * interpolant.gradient(index);
                    // Gradients are covectors: the transposed inverse maps them to physical space.
                    const double slope = length({dot(column(to_index, 0), g), dot(column(to_index, 1), g),
                                                 dot(column(to_index, 2), g)});
                    // Written so that a slope of 0 or NaN is capped.
                    const auto distance = [&](double change) {
                        return static_cast<float>(change < report.cap * slope ? change / slope : report.cap);
                    };
                    report.shift[i] = distance(report.step);
                    report.noise_shift[i] =
                        report.noise.sigma > 0
                            ? distance(report.noise.sigma * interpolant.noise_weight(index))
                            : 0;
                }
                stage.step();
            });
        });
    });
    std::vector<float> shifts, noise_shifts;
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (!within[i]) continue;
        shifts.push_back(report.shift[i]);
        noise_shifts.push_back(report.noise_shift[i]);
    }
    report.border_points = static_cast<std::int64_t>(points.size() - shifts.size());
    report.shifts = percentiles(std::move(shifts), report.cap);
    report.noise_shifts = percentiles(std::move(noise_shifts), report.cap);
    return report;
}

}  // namespace marrow
