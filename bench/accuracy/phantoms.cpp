// Samples shapes as a scanner would.
#include "phantoms.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include <tbb/parallel_for.h>

namespace marrow::bench {
namespace {

double normal_density(double x, double sigma) {
    return std::exp(-x * x / (2 * sigma * sigma)) / (sigma * std::sqrt(2 * std::numbers::pi));
}

// The part of a normal distribution around 0 that is below `edge`.
double below(double edge, double sigma) {
    return 0.5 * (1 + std::erf(edge / (std::numbers::sqrt2 * sigma)));
}

double between(double from, double to, double sigma) {
    return below(to, sigma) - below(from, sigma);
}

// A blurred disc at a distance from its centre, by Simpson's rule over strips.
double blurred_disc(double distance, double radius, double sigma) {
    constexpr int kStrips = 400;
    double sum = 0;
    for (int i = 0; i <= kStrips; ++i) {
        const double x = radius * (2.0 * i / kStrips - 1),
                     half = std::sqrt(std::max(0.0, radius * radius - x * x));
        const double weight = i == 0 || i == kStrips ? 1 : i % 2 == 1 ? 4 : 2;
        sum += weight * normal_density(x - distance, sigma) * between(-half, half, sigma);
    }
    return sum * 2 * radius / kStrips / 3;
}

}  // namespace

Shape blurred_ball(const Vec3d& centre, double radius, double sigma) {
    const auto blurred = [=](const Vec3d& p) {
        const double r = std::max(length(p - centre), 1e-6);
        return between(r - radius, r + radius, sigma) -
               sigma * sigma / r * (normal_density(radius - r, sigma) - normal_density(radius + r, sigma));
    };
    return {blurred, [=](const Vec3d& p) { return length(p - centre) - radius; }};
}

Shape blurred_tube(const Vec3d& centre, const Vec3d& direction, double radius, double sigma) {
    constexpr double kStep = 0.01;
    auto profile = std::make_shared<std::vector<double>>();
    for (double d = 0; d <= radius + 6 * sigma; d += kStep)
        profile->push_back(blurred_disc(d, radius, sigma));
    const Vec3d unit = (1 / length(direction)) * direction;
    const auto from_axis = [=](const Vec3d& p) { return length(cross(p - centre, unit)); };
    const auto blurred = [=](const Vec3d& p) {
        const double at = from_axis(p) / kStep;
        const auto i = static_cast<std::size_t>(at);
        if (i + 1 >= profile->size()) return 0.0;
        return std::lerp((*profile)[i], (*profile)[i + 1], at - std::floor(at));
    };
    return {blurred, [=](const Vec3d& p) { return from_axis(p) - radius; }};
}

Coverage blurred_box(const Vec3d& centre, const Mat3d& axes, const Vec3d& half, double sigma) {
    return [=](const Vec3d& p) {
        double coverage = 1;
        for (std::size_t a = 0; a < 3; ++a) {
            const double x = dot(column(axes, a), p - centre);
            coverage *= between(x - half[a], x + half[a], sigma);
        }
        return coverage;
    };
}

Volume scan(const Coverage& coverage, double size, const Scanner& scanner) {
    Geometry g;
    g.spacing = {scanner.spacing, scanner.spacing, scanner.slice};
    for (std::size_t a = 0; a < 3; ++a) {
        g.dims[a] = static_cast<std::int64_t>(size / g.spacing[a]) + 1;
        g.origin[a] = -0.5 * g.spacing[a] * static_cast<double>(g.dims[a] - 1);
    }
    Volume volume(g, SampleType::int16);
    auto* const samples = volume.samples<std::int16_t>();
    constexpr int kLayers = 8;  // positions within the thickness of a slice
    tbb::parallel_for(std::int64_t{0}, g.dims[2], [&](std::int64_t z) {
        std::mt19937_64 random(scanner.seed * 1000 + static_cast<std::uint64_t>(z));
        std::normal_distribution<double> noise(0, 1);
        for (std::int64_t y = 0; y < g.dims[1]; ++y) {
            for (std::int64_t x = 0; x < g.dims[0]; ++x) {
                double mean = 0;
                for (int layer = 0; layer < kLayers; ++layer) {
                    const double k = static_cast<double>(z) + (layer + 0.5) / kLayers - 0.5;
                    mean +=
                        coverage(g.physical({static_cast<double>(x), static_cast<double>(y), k})) / kLayers;
                }
                const double value =
                    std::lerp(scanner.background, scanner.material, mean) + scanner.noise * noise(random);
                samples[(z * g.dims[1] + y) * g.dims[0] + x] =
                    static_cast<std::int16_t>(std::clamp(std::round(value), -1024.0, 3071.0));
            }
        }
    });
    return volume;
}

double interpolate(const Volume& scan, const Vec3d& position) {
    const Geometry& g = scan.geometry();
    std::array<std::int64_t, 3> cell;
    Vec3d fraction;
    for (std::size_t a = 0; a < 3; ++a) {
        const double index = (position[a] - g.origin[a]) / g.spacing[a];
        cell[a] = std::clamp<std::int64_t>(static_cast<std::int64_t>(std::floor(index)), 0, g.dims[a] - 2);
        fraction[a] = index - static_cast<double>(cell[a]);
    }
    const auto* const samples = scan.samples<std::int16_t>();
    double value = 0;
    for (std::size_t corner = 0; corner < 8; ++corner) {
        double weight = 1;
        std::array<std::int64_t, 3> at = cell;
        for (std::size_t a = 0; a < 3; ++a) {
            const bool upper = (corner >> a & 1) != 0;
            weight *= upper ? fraction[a] : 1 - fraction[a];
            at[a] += upper;
        }
        value += weight * samples[(at[2] * g.dims[1] + at[1]) * g.dims[0] + at[0]];
    }
    return value;
}

}  // namespace marrow::bench
