// The trust report and the estimate of noise, against closed forms and against
// surfaces that are extracted again.
#include <marrow/trust.h>

#include <cmath>
#include <numbers>
#include <numeric>

#include <gtest/gtest.h>

#include <marrow/error.h>
#include <marrow/isosurface.h>
#include <marrow/measure.h>

#include "support/fields.h"

namespace marrow::test {
namespace {

constexpr double kSigma = 2;  // mm: the blur of the edges

// An edge across x, from -1000 to 1000 at 20 mm, blurred by a Gaussian.
double blurred_edge(double x) {
    return 1000 * std::erf((x - 20) / (std::sqrt(2.0) * kSigma));
}

Geometry oblique_grid() {
    Geometry g = grid(24, 20, 16);
    g.spacing = {0.7, 0.7, 2.5};
    g.origin = {-30, 12, 100};
    const double c = std::cos(0.3), s = std::sin(0.3);
    g.direction = {Vec3d{c, -s, 0}, Vec3d{s, c, 0.2},
                   Vec3d{0, 0, std::sqrt(1 - 0.04)}};  // rotated and sheared
    return g;
}

TEST(Trust, IsExactWhereSamplesAreLinear) {
    const Vec3d gradient{30, -14, 55};  // per mm
    const Volume volume =
        sampled_in_space<float>(oblique_grid(), [&](const Vec3d& p) { return dot(gradient, p); });
    const double middle = dot(gradient, volume.geometry().physical({12, 10, 8}));
    const Mesh mesh = extract_isosurface(volume, middle);
    ASSERT_GT(mesh.points.size(), 100u);
    const TrustReport report = report_trust(volume, mesh.points, {.step = 10});
    for (const float shift : report.shift)
        EXPECT_NEAR(shift, 10 / length(gradient), 1e-4 * 10 / length(gradient));
    EXPECT_EQ(report.shifts.capped, 0);
    EXPECT_EQ(report.border_points, 0);
}

TEST(Trust, AgreesWithTheSlopeOfABlurredEdge) {
    const Volume volume =
        sampled_in_space<float>(grid(41, 8, 8), [](const Vec3d& p) { return blurred_edge(p[0]); });
    for (const double isovalue : {-600.0, -150.0, 0.0, 330.0, 700.0}) {
        const Mesh mesh = extract_isosurface(volume, isovalue);
        const TrustReport report = report_trust(volume, mesh.points, {.step = 100});
        for (std::size_t i = 0; i < mesh.points.size(); ++i) {
            const double u = (mesh.points[i][0] - 20) / kSigma;
            const double slope = 2000 / (kSigma * std::sqrt(2 * std::numbers::pi)) * std::exp(-u * u / 2);
            EXPECT_NEAR(report.shift[i] * slope / 100, 1, 0.06) << isovalue;
        }
    }
}

// What the report promises: the surfaces of half a step more and half a step less are that far apart.
TEST(Trust, SaysHowFarTheSurfaceMoves) {
    const Volume volume = sampled_in_space<float>(grid(48, 48, 48), [](const Vec3d& p) {
        return blurred_edge(20 + 15 - length(p - Vec3d{23.5, 23.2, 23.9}));
    });
    const Mesh mesh = extract_isosurface(volume, 200);
    const TrustReport report = report_trust(volume, mesh.points, {.step = 100});
    const double mean = std::accumulate(report.shift.begin(), report.shift.end(), 0.0) /
                        static_cast<double>(report.shift.size());
    const MeshDistance moved =
        mesh_distance(extract_isosurface(volume, 150), extract_isosurface(volume, 250));
    EXPECT_NEAR(mean / moved.mean, 1, 0.05);
}

// A noisy edge, whose slope is at the same place in every row. Rows are independent.
Volume noisy_edge(double sigma, std::uint64_t seed) {
    Random random(seed);
    std::normal_distribution<double> noise(0, sigma);
    return sampled<std::int16_t>(grid(41, 60, 60), [&](auto x, auto, auto) {
        return std::lround(blurred_edge(static_cast<double>(x)) + noise(random));
    });
}

TEST(Trust, SaysHowFarNoiseMovesPoints) {
    constexpr double kNoise = 20;
    const Volume volume = noisy_edge(kNoise, 1);
    Mesh mesh = extract_isosurface(volume, 77);
    std::erase_if(mesh.points,
                  [](const Vec3f& p) { return p[1] != std::round(p[1]) || p[2] != std::round(p[2]); });
    double mean = 0, variance = 0;
    for (const Vec3f& p : mesh.points) mean += p[0];
    mean /= static_cast<double>(mesh.points.size());
    for (const Vec3f& p : mesh.points) variance += (p[0] - mean) * (p[0] - mean);
    const double measured = std::sqrt(variance / static_cast<double>(mesh.points.size()));
    const TrustReport report = report_trust(volume, mesh.points);
    EXPECT_NEAR(report.noise_shifts.median / measured, 1, 0.1);
    EXPECT_LT(report.noise_shifts.median, report.noise_shifts.percentile_90);
    EXPECT_LT(report.noise_shifts.percentile_90, report.noise_shifts.percentile_99);
}

TEST(Trust, TheStepIsATenthOfTheContrastUnlessGiven) {
    const Volume volume =
        sampled<float>(grid(20, 10, 10), [](auto x, auto, auto) { return x < 10 ? 3 : 11; });
    const Mesh mesh = extract_isosurface(volume, 7);
    EXPECT_NEAR(report_trust(volume, mesh.points).step, 0.8, 0.01);
}

// A flat edge moves without limit; the distance is capped at a sample, and the cap is counted.
TEST(Trust, CapsAtOneSample) {
    Geometry g = grid(20, 5, 5);
    g.spacing = {1, 2, 3};
    const Volume volume = sampled<float>(g, [](auto x, auto, auto) { return x; });
    const Mesh mesh = extract_isosurface(volume, 7.5);
    const TrustReport report = report_trust(volume, mesh.points, {.step = 100});
    EXPECT_EQ(report.cap, 3);
    EXPECT_EQ(report.shifts.capped, static_cast<std::int64_t>(mesh.points.size()));
    EXPECT_EQ(report.shifts.median, 3);
}

TEST(Trust, PointsThatCloseTheSurfaceDoNotMove) {
    const Volume volume = sampled<float>(grid(12, 12, 12), [](auto x, auto, auto) { return 6.3 - x; });
    const Mesh mesh = extract_isosurface(volume, 0, {.closed = true});
    const TrustReport report = report_trust(volume, mesh.points, {.step = 0.5});
    std::int64_t still = 0;
    for (std::size_t i = 0; i < mesh.points.size(); ++i) {
        const bool within = std::all_of(mesh.points[i].begin(), mesh.points[i].end(),
                                        [](float c) { return c >= 0 && c <= 11; });
        EXPECT_EQ(report.shift[i] > 0, within);
        still += !within;
    }
    EXPECT_GT(still, 0);
    EXPECT_EQ(report.border_points, still);
    EXPECT_NEAR(report.shifts.percentile_99, 0.5, 1e-6);
}

TEST(Trust, DoesNotDependOnThreads) {
    const Volume volume = noisy_edge(30, 2);
    const Mesh mesh = extract_isosurface(volume, 0);
    const TrustReport one = report_trust(volume, mesh.points, {.threads = 1});
    const TrustReport all = report_trust(volume, mesh.points, {.threads = 0});
    EXPECT_EQ(one.shift, all.shift);
    EXPECT_EQ(one.noise_shift, all.noise_shift);
    EXPECT_EQ(one.noise.sigma, all.noise.sigma);
}

TEST(Trust, RefusesAStepThatIsNotPositive) {
    const Volume volume = sampled<float>(grid(4, 4, 4), [](auto x, auto, auto) { return x; });
    for (const double step : {0.0, -1.0, std::nan("")})
        EXPECT_THROW(report_trust(volume, {}, {.step = step}), InputError);
}

// Two tissues, with edges between them, and air that is cut off.
TEST(Noise, AgreesWithWhatWasAdded) {
    for (const double sigma : {4.0, 25.0}) {
        Random random(7);
        std::normal_distribution<double> noise(0, sigma);
        const Volume volume = sampled<std::int16_t>(grid(140, 140, 40), [&](auto x, auto y, auto) {
            const double tissue = x < 50 ? -1000 : std::hypot(x - 90, y - 70) < 25 ? 60 : -80;
            return std::max(-1024L, std::lround(tissue + noise(random)));
        });
        const NoiseEstimate found = estimate_noise(volume);
        EXPECT_NEAR(found.sigma / sigma, 1, 0.05);
        EXPECT_NEAR(found.local_deviation / sigma, 1, 0.05);
        EXPECT_NEAR(found.slices.value() / sigma, 1, 0.08);
        EXPECT_NEAR(found.laplacian / sigma, 1, 0.08);
        EXPECT_LE(found.lowest, found.sigma);
        EXPECT_GE(found.highest, found.sigma);
        EXPECT_GT(found.windows, 1000);
    }
}

// Noise that is smooth within slices: the Laplacian misses it, and the doubt shows that.
TEST(Noise, DoubtIsLargeWhereNoiseIsNotWhite) {
    Random random(3);
    std::normal_distribution<double> noise(0, 60);
    const Volume white = sampled<float>(grid(140, 140, 20), [&](auto, auto, auto) { return noise(random); });
    const Volume volume = sampled<float>(grid(136, 136, 20), [&](auto x, auto y, auto z) {
        double mean = 0;
        for (int j = 0; j < 3; ++j) {
            for (int i = 0; i < 3; ++i) mean += white.samples<float>()[(z * 140 + y + j) * 140 + x + i] / 9.0;
        }
        return mean + (x < 60 ? -1000 : 0);
    });
    const NoiseEstimate found = estimate_noise(volume);  // the deviation is 60 / 3
    EXPECT_NEAR(found.sigma / 20, 1, 0.15);
    EXPECT_LT(found.lowest, 0.7 * found.sigma);
}

// Air that is cut off is constant, and would say that there is no noise.
TEST(Noise, AirInTheFirstSlicesIsNoTissue) {
    struct Case {
        std::array<std::int64_t, 3> dims;
        std::int64_t air;  // so many slices
    };
    for (const Case& c : {Case{{140, 140, 4}, 1}, Case{{140, 140, 12}, 6}, Case{{1200, 1200, 9}, 2}}) {
        Random random(8);
        std::normal_distribution<float> noise(0, 20);
        const auto& dims = c.dims;
        const Volume volume =
            sampled<std::int16_t>(grid(dims[0], dims[1], dims[2]), [&](auto x, auto, auto z) {
                return z < c.air || x < dims[0] / 4 ? -1024 : std::lround(50 + noise(random));
            });
        const NoiseEstimate found = estimate_noise(volume);
        EXPECT_NEAR(found.sigma / 20, 1, 0.05) << dims[2];
        EXPECT_NEAR(found.local_deviation / 20, 1, 0.05) << dims[2];
    }
}

// Padding above tissue, as in scans whose PixelPaddingValue is 4095 or 65535, is not even tissue.
TEST(Noise, LeavesPaddingOut) {
    Random random(10);
    std::normal_distribution<float> noise(0, 20);
    const Volume volume = sampled<std::int16_t>(grid(140, 140, 12), [&](auto x, auto y, auto) {
        const double from_centre = std::hypot(x - 70, y - 70);
        if (from_centre > 68) return 4095l;
        return from_centre > 50 ? -1000l : std::lround(50 + noise(random));
    });
    EXPECT_EQ(estimate_noise(volume).sigma, 0);
    const NoiseEstimate found = estimate_noise(volume, {.padding = 4095});
    EXPECT_NEAR(found.sigma / 20, 1, 0.05);
    EXPECT_NEAR(found.laplacian / 20, 1, 0.05);

    const Mesh mesh = extract_isosurface(volume, -475);
    EXPECT_NEAR(report_trust(volume, mesh.points, {.padding = 4095}).step, 105, 1);
    EXPECT_EQ(report_trust(volume, mesh.points, {.padding = 4095}).noise.sigma, found.sigma);
}

// Tissue is first sought in every fourth row. Here these are of air, and so a part of each window is.
TEST(Noise, IsUnknownWhereAirIsInEachWindow) {
    Random random(9);
    std::normal_distribution<float> noise(0, 20);
    const Volume volume = sampled<std::int16_t>(grid(140, 300, 12), [&](auto, auto y, auto) {
        return y % 4 == 0 ? -1024 : std::lround(50 + noise(random));
    });
    EXPECT_EQ(estimate_noise(volume).windows, 0);
}

TEST(Noise, IsUnknownWhereSquaresOverflow) {
    Random random(11);
    std::normal_distribution<double> noise(0, 1e200);
    const Volume volume = sampled<double>(grid(70, 70, 3), [&](auto, auto, auto) { return noise(random); });
    const NoiseEstimate found = estimate_noise(volume);
    EXPECT_EQ(found.windows, 0);
    EXPECT_EQ(found.sigma, 0);
}

TEST(Noise, IsUnknownWithoutAWindow) {
    const Volume volume = sampled<float>(grid(5, 5, 5), [](auto x, auto, auto) { return x; });
    const NoiseEstimate found = estimate_noise(volume);
    EXPECT_EQ(found.windows, 0);
    EXPECT_EQ(found.sigma, 0);
}

}  // namespace
}  // namespace marrow::test
