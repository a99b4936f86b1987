// Crop, median, blur and resampling.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include <marrow/error.h>
#include <marrow/isosurface.h>
#include <marrow/measure.h>
#include <marrow/volume_filters.h>

#include "support/fields.h"

namespace marrow::test {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

Geometry oblique(std::int64_t nx, std::int64_t ny, std::int64_t nz) {
    Geometry g = grid(nx, ny, nz);
    g.spacing = {1, 0.5, 3};
    g.origin = {100, -50, 7};
    g.direction = {{{0, -1, 0}, {0.6, 0, 0.8}, {0.8, 0, -0.6}}};
    return g;
}

template <class T>
T at(const Volume& volume, std::int64_t x, std::int64_t y, std::int64_t z) {
    const auto& d = volume.geometry().dims;
    return volume.samples<T>()[(z * d[1] + y) * d[0] + x];
}

/// A different value at each sample.
template <class T>
Volume numbered(const Geometry& g) {
    return sampled<T>(g, [&](auto x, auto y, auto z) { return (z * g.dims[1] + y) * g.dims[0] + x; });
}

void expect_near(const Vec3d& a, const Vec3d& b) {
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(a[i], b[i], 1e-9);
}

// ---- crop ----

TEST(Crop, KeepsSamplesWhereTheyWere) {
    const Volume volume = numbered<std::int16_t>(oblique(7, 6, 5));
    const Volume part = crop(volume, {1, 2, 3}, {4, 2, 4});
    EXPECT_EQ(part.geometry().dims, (std::array<std::int64_t, 3>{4, 1, 2}));
    EXPECT_EQ(part.type(), SampleType::int16);
    for (std::int64_t z = 0; z < 2; ++z) {
        for (std::int64_t x = 0; x < 4; ++x)
            EXPECT_EQ(at<std::int16_t>(part, x, 0, z), at<std::int16_t>(volume, x + 1, 2, z + 3));
    }
    expect_near(part.geometry().physical({3, 0, 1}), volume.geometry().physical({4, 2, 4}));
    EXPECT_THROW(crop(volume, {0, 0, 0}, {7, 5, 4}), InputError);
    EXPECT_THROW(crop(volume, {0, -1, 0}, {6, 5, 4}), InputError);
    EXPECT_THROW(crop(volume, {3, 0, 0}, {2, 5, 4}), InputError);
}

TEST(Crop, ByABoxAlongTheAxesKeepsTheSamplesInIt) {
    Geometry g = grid(10, 10, 10);
    g.spacing = {2, 1, 1};
    g.origin = {-5, 20, 0};
    g.direction[1][1] = -1;  // y runs from 20 down to 11
    const Volume volume = numbered<float>(g);
    const Volume part = crop(volume, Box{{-1, 12.5, -100}, {3.9, 15, 3}});
    EXPECT_EQ(part.geometry().dims, (std::array<std::int64_t, 3>{3, 3, 4}));
    expect_near(part.geometry().origin, {-1, 15, 0});
    EXPECT_EQ(at<float>(part, 0, 0, 0), at<float>(volume, 2, 5, 0));
}

TEST(Crop, ByABoxKeepsMoreOfAnObliqueVolume) {
    const Volume volume = numbered<float>(oblique(40, 60, 20));
    const Vec3d middle = volume.geometry().physical({20, 30, 10});
    const Box box{{middle[0] - 3, middle[1] - 4, middle[2] - 5},
                  {middle[0] + 3, middle[1] + 4, middle[2] + 5}};
    const Volume part = crop(volume, box);
    const auto in_box = [&](const Volume& v) {
        const auto& d = v.geometry().dims;
        int count = 0;
        for (std::int64_t z = 0; z < d[2]; ++z) {
            for (std::int64_t y = 0; y < d[1]; ++y) {
                for (std::int64_t x = 0; x < d[0]; ++x) {
                    const Vec3d p = v.geometry().physical(
                        {static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)});
                    bool in = true;
                    for (std::size_t i = 0; i < 3; ++i)
                        in = in && p[i] >= box.lower[i] && p[i] <= box.upper[i];
                    count += in;
                }
            }
        }
        return count;
    };
    EXPECT_GT(in_box(volume), 200);
    EXPECT_EQ(in_box(part), in_box(volume));
    EXPECT_LT(part.geometry().sample_count(), volume.geometry().sample_count() / 4);
    EXPECT_THROW(crop(volume, Box{{1e4, 0, 0}, {2e4, 1, 1}}), InputError);
    EXPECT_THROW(crop(volume, Box{{1, 0, 0}, {0, 1, 1}}), InputError);
    EXPECT_THROW(crop(volume, Box{{kNan, 0, 0}, {0, 1, 1}}), InputError);
}

TEST(Crop, ByABoxWithoutEnds) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    const Box everything{{-kInfinity, -kInfinity, -kInfinity}, {kInfinity, kInfinity, kInfinity}};
    const Volume straight = numbered<float>(grid(4, 5, 6)), turned = numbered<float>(oblique(4, 5, 6));
    for (const Volume* volume : {&straight, &turned})
        EXPECT_EQ(crop(*volume, everything).geometry().dims, volume->geometry().dims);
    const Volume slab = crop(straight, Box{{1.5, -kInfinity, -kInfinity}, {3, kInfinity, 2}});
    EXPECT_EQ(slab.geometry().dims, (std::array<std::int64_t, 3>{2, 5, 3}));
    EXPECT_THROW(crop(straight, Box{{9, -kInfinity, 0}, {kInfinity, kInfinity, 1}}), InputError);
}

// ---- median ----

TEST(Median, IsTheMedianOfTheWindow) {
    Random random(2);
    const Geometry g = oblique(6, 7, 5);
    const Volume volume = sampled<std::int16_t>(g, [&](auto, auto, auto) { return random() % 1000; });
    for (const int radius : {1, 2}) {
        const Volume result = median_filter(volume, radius);
        EXPECT_EQ(result.type(), SampleType::int16);
        for (std::int64_t z = 0; z < 5; ++z) {
            for (std::int64_t y = 0; y < 7; ++y) {
                for (std::int64_t x = 0; x < 6; ++x) {
                    std::vector<std::int16_t> window;
                    for (std::int64_t k = z - radius; k <= z + radius; ++k) {
                        for (std::int64_t j = y - radius; j <= y + radius; ++j) {
                            for (std::int64_t i = x - radius; i <= x + radius; ++i) {
                                if (i >= 0 && j >= 0 && k >= 0 && i < 6 && j < 7 && k < 5)
                                    window.push_back(at<std::int16_t>(volume, i, j, k));
                            }
                        }
                    }
                    std::sort(window.begin(), window.end());
                    ASSERT_EQ(at<std::int16_t>(result, x, y, z), window[window.size() / 2]);
                }
            }
        }
    }
}

TEST(Median, RemovesSpecksAndKeepsEdges) {
    const auto edge = [](auto x, auto, auto) { return x < 4 ? 0.0 : 100.0; };
    const Volume clean = sampled<float>(grid(9, 9, 9), edge);
    const Volume specks = sampled<float>(grid(9, 9, 9), [&](auto x, auto y, auto z) {
        return x == 2 && y == 2 && z == 2 ? 1e6 : x == 6 && y == 6 && z == 3 ? -1e6 : edge(x, y, z);
    });
    const Volume result = median_filter(specks, 1);
    EXPECT_TRUE(std::equal(clean.samples<float>(), clean.samples<float>() + 729, result.samples<float>()));
}

TEST(Median, LeavesNanOut) {
    const Volume volume =
        sampled<float>(grid(3, 3, 1), [](auto x, auto y, auto) { return x == y ? kNan : 5; });
    const Volume result = median_filter(volume, 1);
    EXPECT_TRUE(std::isnan(at<float>(result, 1, 1, 0)));
    EXPECT_EQ(at<float>(result, 0, 1, 0), 5);
}

// ---- blur ----

TEST(Gaussian, HasTheStandardDeviationInMillimetres) {
    const Volume point = sampled<std::uint8_t>(
        oblique(41, 81, 21), [](auto x, auto y, auto z) { return x == 20 && y == 40 && z == 10 ? 255 : 0; });
    const double sigma = 2.5;
    const Volume result = gaussian_filter(point, sigma);
    EXPECT_EQ(result.type(), SampleType::float32);
    EXPECT_EQ(result.geometry().index_to_physical(), point.geometry().index_to_physical());
    double sum = 0;
    Vec3d variance{};
    for (std::int64_t z = 0; z < 21; ++z) {
        for (std::int64_t y = 0; y < 81; ++y) {
            for (std::int64_t x = 0; x < 41; ++x) {
                const double value = at<float>(result, x, y, z);
                const double off[3] = {static_cast<double>(x - 20), 0.5 * static_cast<double>(y - 40),
                                       3 * static_cast<double>(z - 10)};
                sum += value;
                for (std::size_t a = 0; a < 3; ++a) variance[a] += value * off[a] * off[a];
            }
        }
    }
    EXPECT_NEAR(sum, 255, 0.01);
    for (const double v : variance) EXPECT_NEAR(std::sqrt(v / sum), sigma, 0.02);
}

TEST(Gaussian, KeepsAConstantAtTheBorderAndBesideNan) {
    const Volume volume = sampled<float>(
        grid(8, 8, 8), [](auto x, auto y, auto z) { return x == 3 && y == 3 && z == 3 ? kNan : 42; });
    const Volume result = gaussian_filter(volume, 1.5);
    for (std::int64_t i = 0; i < 512; ++i) {
        const float value = result.samples<float>()[i];
        if (i == 3 * 64 + 3 * 8 + 3)
            EXPECT_TRUE(std::isnan(value));
        else
            EXPECT_NEAR(value, 42, 1e-4);
    }
}

TEST(Gaussian, KeepsTheValueOfAPlateau) {
    const Volume volume =
        sampled<std::int16_t>(grid(60, 24, 24), [](auto x, auto, auto) { return x < 30 ? 1000 : -1024; });
    for (const double sigma : {0.7, 1.0, 1.3}) {
        const Volume result = gaussian_filter(volume, sigma);
        for (std::int64_t z = 0; z < 24; ++z) {
            for (std::int64_t y = 0; y < 24; ++y) {
                ASSERT_EQ(at<float>(result, 10, y, z), 1000) << y << ' ' << z;
                ASSERT_EQ(at<float>(result, 50, y, z), -1024) << y << ' ' << z;
            }
        }
    }
}

TEST(Gaussian, RemovesTheStairsOfAMask) {
    const auto field = sphere({16, 16, 16}, 11.2);
    const Volume mask =
        sampled_in_space<std::uint8_t>(grid(33, 33, 33), [&](const Vec3d& p) { return field(p) > 0; });
    const Volume blurred = gaussian_filter(mask, 1);
    const double before = roughness(extract_isosurface(mask, 0.5), 2).roughness;
    EXPECT_LT(roughness(extract_isosurface(blurred, 0.5), 2).roughness, 0.3 * before);
}

// ---- resampling ----

TEST(Resample, KeepsSamplesAtOldPositions) {
    const Volume volume = numbered<std::int32_t>(oblique(4, 9, 5));
    const Volume result = resample_isotropic(volume, 1);
    EXPECT_EQ(result.type(), SampleType::float64);
    EXPECT_EQ(result.geometry().dims, (std::array<std::int64_t, 3>{4, 5, 13}));
    EXPECT_EQ(result.geometry().spacing, (Vec3d{1, 1, 1}));
    for (std::int64_t z = 0; z < 5; ++z) {
        for (std::int64_t y = 0; y < 5; ++y) {
            for (std::int64_t x = 0; x < 4; ++x) {
                EXPECT_EQ(at<double>(result, x, y, 3 * z), at<std::int32_t>(volume, x, 2 * y, z));
                expect_near(result.geometry().physical({double(x), double(y), double(3 * z)}),
                            volume.geometry().physical({double(x), double(2 * y), double(z)}));
            }
        }
    }
}

// As NIfTI has it: the last slice is there, although 0.7f and 0.35f are a little less than the double.
// The thickness of a single slice is all that is known of it.
TEST(Resample, KeepsTheThicknessOfASingleSlice) {
    Geometry geometry = grid(8, 8, 1);
    geometry.spacing = {1, 1, 5};
    const Volume volume = sampled<float>(geometry, [](auto x, auto y, auto) { return x * y; });
    EXPECT_EQ(resample_isotropic(volume, 0.5).geometry().spacing, (Vec3d{0.5, 0.5, 5}));
}

TEST(Resample, TakesSpacingsThatWereFloat32) {
    Geometry g = grid(5, 4, 101);
    g.spacing = {0.7f, 1.4f, 2.8f};
    const Volume volume = numbered<std::int16_t>(g);
    for (const double more : {1.0, 1 + 1e-7, 1 - 1e-7}) {
        const Volume result = resample_isotropic(volume, 0.7 * more);
        EXPECT_EQ(result.geometry().dims, (std::array<std::int64_t, 3>{5, 7, 401}));
        EXPECT_EQ(at<float>(result, 4, 6, 400), at<std::int16_t>(volume, 4, 3, 100));
        EXPECT_EQ(at<float>(result, 3, 2, 40), at<std::int16_t>(volume, 3, 1, 10));
    }
}

TEST(Resample, RefusesWhatDoesNotFitBeforeItIsMade) {
    Geometry g = grid(64, 64, 64);
    g.spacing = {1000, 1000, 1000};
    const Volume volume = numbered<std::uint8_t>(g);
    EXPECT_THROW(resample_isotropic(volume, 0.001), LimitError);
}

TEST(Resample, IsExactForParabolasInside) {
    Geometry g = grid(3, 3, 20);
    g.spacing[2] = 1.7;
    const auto parabola = [](const Vec3d& p) { return 0.3 * p[2] * p[2] - 2 * p[2] + 5; };
    const Volume volume = sampled_in_space<double>(g, parabola);
    const Volume result = resample_isotropic(volume, 0.31);
    const std::int64_t n = result.geometry().dims[2];
    EXPECT_EQ(n, static_cast<std::int64_t>(19 * 1.7 / 0.31) + 1);
    for (std::int64_t z = 6; z < n - 6; ++z)
        EXPECT_NEAR(at<double>(result, 0, 0, z), parabola({0, 0, 0.31 * static_cast<double>(z)}), 1e-9);
}

TEST(Resample, MakesThickSlicesOfABallSmoother) {
    Geometry g = grid(41, 41, 11);
    g.spacing[2] = 4;
    const Volume ball = sampled_in_space<float>(g, sphere({20, 20, 20}, 14));
    const Volume even = resample_isotropic(ball, 1);
    const auto error = [](const Mesh& mesh) {
        double sum = 0;
        for (const Vec3f& p : mesh.points) sum += std::abs(std::hypot(p[0] - 20, p[1] - 20, p[2] - 20) - 14);
        return sum / static_cast<double>(mesh.points.size());
    };
    EXPECT_LT(error(extract_isosurface(even, 0)), 0.5 * error(extract_isosurface(ball, 0)));
}

TEST(Filters, AcceptEveryTypeAndOneThread) {
    const auto try_type = [](auto sample) {
        const Volume volume = numbered<decltype(sample)>(grid(4, 3, 5));
        EXPECT_EQ(median_filter(volume, 1, {.threads = 1}).type(), volume.type());
        for (const Volume& result :
             {gaussian_filter(volume, 1, {.threads = 1}), resample_isotropic(volume, 0.5, {.threads = 1})})
            EXPECT_EQ(result.type(), sizeof sample > 4 || volume.type() == SampleType::int32
                                         ? SampleType::float64
                                         : SampleType::float32);
    };
    try_type(std::uint8_t{}), try_type(std::int8_t{}), try_type(std::uint16_t{}), try_type(std::int16_t{});
    try_type(std::int32_t{}), try_type(float{}), try_type(double{});
}

TEST(Filters, RefuseBadArgumentsAndCanBeCancelled) {
    const Volume volume = numbered<float>(grid(4, 4, 4));
    for (const double bad : {0.0, -1.0, static_cast<double>(kNan), HUGE_VAL}) {
        EXPECT_THROW(gaussian_filter(volume, bad), InputError);
        EXPECT_THROW(resample_isotropic(volume, bad), InputError);
    }
    EXPECT_THROW(resample_isotropic(volume, 1e-12), LimitError);
    EXPECT_THROW(median_filter(volume, 0), InputError);
    EXPECT_THROW(median_filter(volume, 17), InputError);
    const FilterOptions stopped{.progress = [](double) { return false; }};
    EXPECT_THROW(median_filter(volume, 1, stopped), Cancelled);
    EXPECT_THROW(gaussian_filter(volume, 1, stopped), Cancelled);
    EXPECT_THROW(resample_isotropic(volume, 0.5, stopped), Cancelled);
}

}  // namespace
}  // namespace marrow::test
