// A sweep measures what the extracted meshes measure, and finds plateaus.
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include <marrow/isosurface.h>
#include <marrow/isovalue_sweep.h>
#include <marrow/measure.h>

#include "support/fields.h"

namespace marrow::test {
namespace {

void expect_as_measured(const Volume& volume, const std::vector<double>& isovalues, bool topology = false) {
    const std::vector<SweepSample> sweep = sweep_isovalues(volume, isovalues, {.topology = topology});
    ASSERT_EQ(sweep.size(), isovalues.size());
    for (std::size_t k = 0; k < isovalues.size(); ++k) {
        SCOPED_TRACE(isovalues[k]);
        const MeshMeasures m =
            measure(extract_isosurface(volume, isovalues[k], {.closed = true, .topology = topology}));
        EXPECT_EQ(sweep[k].isovalue, isovalues[k]);
        EXPECT_EQ(sweep[k].triangles, m.triangles);
        EXPECT_EQ(sweep[k].components, m.components);
        // The mesh's coordinates are rounded to some 1e-6 mm.
        EXPECT_NEAR(sweep[k].area, m.area, 1e-6 * m.area + 1e-6 * static_cast<double>(m.triangles));
        EXPECT_NEAR(sweep[k].volume, m.volume, 1e-6 * std::abs(m.volume) + 1e-5 * m.area + 1e-7);
    }
}

template <class T>
Volume noise(const Geometry& geometry, unsigned seed, double lower, double upper) {
    Volume volume(geometry, sample_type_of<T>());
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> value(lower, upper);
    for (std::int64_t i = 0; i < geometry.sample_count(); ++i)
        volume.samples<T>()[i] = static_cast<T>(value(random));
    return volume;
}

Geometry oblique(std::int64_t nx, std::int64_t ny, std::int64_t nz) {
    Geometry g = grid(nx, ny, nz);
    const double c = std::cos(0.4), s = std::sin(0.4);
    g.direction = {{{c, -s, 0}, {s, c, 0.2}, {0, 0, std::sqrt(1 - 0.04)}}};
    g.spacing = {0.7, 0.9, 2.1};
    g.origin = {-15, 3, 7};
    return g;
}

// Inside corners that meet across a face are joined, so noise has fewer pieces.
TEST(Sweep, MeasuresTheSurfacesOfExactTopology) {
    const Volume volume = noise<std::int16_t>(oblique(19, 18, 17), 3, -100, 101);
    const std::vector<double> isovalues{-20.5, 0, 40, 60};
    expect_as_measured(volume, isovalues, true);
    EXPECT_NE(sweep_isovalues(volume, isovalues)[2].components,
              sweep_isovalues(volume, isovalues, {.topology = true})[2].components);
    EXPECT_THROW(
        sweep_isovalues(volume, isovalues, {.progress = [](double) { return false; }, .topology = true}),
        Cancelled);
}

TEST(Sweep, ReportsProgressWhileASurfaceIsExtracted) {
    const Volume volume = noise<std::int16_t>(grid(19, 18, 17), 3, -100, 101);
    double last = 0;
    int before_half = 0;
    const auto report = [&](double fraction) {
        EXPECT_GE(fraction, last);
        last = fraction;
        before_half += fraction < 0.5 ? 1 : 0;
        return true;
    };
    sweep_isovalues(volume, std::vector<double>{0, 40}, {.progress = report, .topology = true});
    EXPECT_GT(before_half, 10);
    EXPECT_EQ(last, 1);
}

// A box far from the middle, and one from end to end.
TEST(Sweep, AgreesWithTheMeshesOfATallStack) {
    for (const std::int64_t end : {4, 20'000}) {
        const Volume volume = sampled<std::uint8_t>(grid(4, 4, 20'000), [&](auto x, auto y, auto z) {
            return x > 0 && x < 3 && y > 0 && y < 3 && z > 1 && z < end ? 203 : 0;
        });
        expect_as_measured(volume, {60, 100});
    }
}

// Between neighbouring numbers, rounding can turn the order of the samples round.
TEST(Sweep, AscendsWhereRoundingSwapsNeighbouringIsovalues) {
    Volume volume = noise<double>(grid(6, 6, 6), 5, 0, 4000);
    Random random(6);
    int turned = 0;
    for (int i = 0; i < 100'000 && turned < 5; ++i) {
        const Rescale rescale{0.001 + 0.001 * static_cast<double>(random() % 10'000),
                              0.1 * static_cast<double>(random() % 40'000) - 2000};
        const double a = rescale.value(static_cast<double>(random() % 4000)), b = std::nextafter(a, 1e9);
        if (!(rescale.sample(b) < rescale.sample(a))) continue;
        ++turned;
        volume.set_rescale(rescale);
        volume.samples<double>()[100] = rescale.sample(b);  // outside at a, and inside at b, which is higher
        const auto sweep = sweep_isovalues(volume, std::vector<double>{a, b});
        EXPECT_EQ(sweep[0].triangles, static_cast<std::int64_t>(
                                          extract_isosurface(volume, a, {.closed = true}).triangles.size()));
        EXPECT_LE(sweep[1].volume, sweep[0].volume);
    }
    EXPECT_GT(turned, 0);
}

TEST(Sweep, AgreesWithTheMeshesOfNoise) {
    const std::vector<double> isovalues{-90, -50, -20.5, 0, 1, 2, 3, 40, 41, 80, 99, 100, 101};
    for (unsigned seed = 0; seed < 4; ++seed) {
        expect_as_measured(noise<std::int16_t>(oblique(9, 8, 7), seed, -100, 101), isovalues);
        expect_as_measured(noise<float>(oblique(70, 5, 4), seed, -100, 101), isovalues);
        expect_as_measured(noise<std::int8_t>(grid(5, 1, 6), seed, -100, 101), isovalues);
        expect_as_measured(noise<double>(grid(3, 4, 5), seed, -100, 101), isovalues);
        expect_as_measured(noise<std::int32_t>(grid(66, 3, 3), seed, -100, 101), isovalues);
    }
}

TEST(Sweep, AgreesWithTheMeshesOfAMirroredGrid) {
    Geometry g = oblique(8, 9, 10);
    for (auto& row : g.direction) row[0] = -row[0];
    expect_as_measured(noise<std::uint16_t>(g, 7, 0, 9), {1, 2, 3.5, 6, 8});
}

TEST(Sweep, AgreesWithMoreIsovaluesThanOnePassTakes) {
    std::vector<double> isovalues;
    for (int i = 0; i < 300; ++i) isovalues.push_back(-110 + 0.75 * i);
    expect_as_measured(noise<std::int16_t>(grid(7, 6, 5), 3, -100, 101), isovalues);
}

TEST(Sweep, CountsNonFiniteSamplesAsOutside) {
    Volume volume = noise<float>(grid(6, 7, 8), 5, 0, 10);
    for (std::int64_t i = 0; i < volume.geometry().sample_count(); i += 5)
        volume.samples<float>()[i] =
            i % 2 ? std::numeric_limits<float>::quiet_NaN() : std::numeric_limits<float>::infinity();
    expect_as_measured(volume, {1, 5, 9});
}

// Differences of the largest numbers are no numbers.
TEST(Sweep, AgreesWithTheMeshesOfTheLargestNumbers) {
    Random random(8);
    const auto volume_of = [&]<class T>(T largest) {
        return sampled<T>(grid(8, 9, 10), [&](auto, auto, auto) {
            return largest * static_cast<T>(static_cast<double>(random() % 2001) / 1000 - 1);
        });
    };
    expect_as_measured(volume_of(std::numeric_limits<double>::max()), {-1.5e308, 0, 1e308, 1.7e308});
    expect_as_measured(volume_of(std::numeric_limits<float>::max()), {-3e38, 0, 1e38, 3.3e38});
}

// The squares of such areas are beyond float32.
TEST(Sweep, ScalesWithSpacingsOfAnySize) {
    Volume volume = noise<std::int16_t>(oblique(19, 18, 17), 7, -100, 101);
    const Geometry geometry = volume.geometry();
    const std::vector<double> isovalues{-20.5, 40};
    const std::vector<SweepSample> sweep = sweep_isovalues(volume, isovalues);
    for (const double scale : {0x1p-60, 0x1p60}) {
        SCOPED_TRACE(scale);
        Geometry scaled = geometry;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            scaled.spacing[axis] *= scale;
            scaled.origin[axis] *= scale;
        }
        const VolumeView view(volume.samples<std::int16_t>(), scaled);
        const std::vector<SweepSample> same = sweep_isovalues(view, isovalues);
        for (std::size_t k = 0; k < isovalues.size(); ++k) {
            EXPECT_EQ(same[k].area, sweep[k].area * scale * scale);
            EXPECT_EQ(same[k].volume, sweep[k].volume * scale * scale * scale);
        }
    }
}

TEST(Sweep, HollowBallsHaveTwoSurfacesEach) {
    const Volume volume = sampled_in_space<float>(grid(40, 20, 20), [](const Vec3d& p) {
        const auto shell = [&](double x) {
            return 2 - std::abs(std::hypot(p[0] - x, p[1] - 9.5, p[2] - 9.5) - 6);
        };
        return std::max(shell(9.5), shell(29.5));
    });
    const auto sweep = sweep_isovalues(volume, std::vector<double>{0, 1, 3});
    EXPECT_EQ(sweep[0].components, 4);
    EXPECT_EQ(sweep[1].components, 4);
    EXPECT_EQ(sweep[2].components, 0);
    EXPECT_EQ(sweep[2].triangles, 0);
    EXPECT_EQ(sweep[2].volume, 0);
}

TEST(Sweep, TheSameForAnyNumberOfThreads) {
    const Volume volume = noise<std::int16_t>(oblique(40, 30, 20), 9, -100, 101);
    const std::vector<double> isovalues{-50, 0, 50};
    const auto one = sweep_isovalues(volume, isovalues, {.threads = 1});
    const auto two = sweep_isovalues(volume, isovalues, {.threads = 2});
    for (std::size_t k = 0; k < isovalues.size(); ++k) {
        EXPECT_EQ(one[k].area, two[k].area);
        EXPECT_EQ(one[k].volume, two[k].volume);
        EXPECT_EQ(one[k].components, two[k].components);
    }
}

TEST(Sweep, RefusesIsovaluesThatDoNotAscend) {
    const Volume volume = noise<std::uint8_t>(grid(3, 3, 3), 1, 0, 9);
    EXPECT_THROW(sweep_isovalues(volume, std::vector<double>{1, 1}), InputError);
    EXPECT_THROW(sweep_isovalues(volume, std::vector<double>{2, 1}), InputError);
    EXPECT_THROW(sweep_isovalues(volume, std::vector<double>{std::nan("")}), InputError);
    EXPECT_TRUE(sweep_isovalues(volume, std::vector<double>{}).empty());
}

TEST(Sweep, CanBeCancelled) {
    const Volume volume = noise<std::uint8_t>(grid(9, 9, 9), 1, 0, 9);
    EXPECT_THROW(
        sweep_isovalues(volume, std::vector<double>{1, 2}, {.progress = [](double) { return false; }}),
        Cancelled);
    double last = 0;
    sweep_isovalues(volume, std::vector<double>{1, 2}, {.progress = [&](double fraction) {
                        EXPECT_GE(fraction, last);
                        last = fraction;
                        return true;
                    }});
    EXPECT_NEAR(last, 1, 1e-9);
}

// A ball of 100 in air of 0 with a slope at its border, and a speck of 1000 inside it.
struct Ball {
    Volume volume = sampled_in_space<float>(grid(32, 32, 32), [](const Vec3d& p) {
        const double r = std::hypot(p[0] - 15.5, p[1] - 15.5, p[2] - 15.5);
        return r < 1 ? 1000 : r < 6 ? 100 : r < 14 ? 20 * (14 - r) / 8 : 0;
    });

    std::vector<Plateau> plateaus(double from, double to, int samples, std::vector<double>& isovalues) const {
        isovalues.clear();
        for (int i = 0; i < samples; ++i) isovalues.push_back(from + (to - from) * i / (samples - 1));
        return find_plateaus(sweep_isovalues(volume, isovalues), 1, 100);
    }
};

TEST(Plateaus, AreWhereTheSurfaceHardlyMoves) {
    const Ball ball;
    std::vector<double> isovalues;
    const auto plateaus = ball.plateaus(0.5, 95.5, 20, isovalues);
    ASSERT_EQ(plateaus.size(), 1u);
    EXPECT_GE(isovalues[plateaus[0].first], 20) << "the top of the slope";
    EXPECT_LE(isovalues[plateaus[0].first], 26);
    EXPECT_EQ(plateaus[0].last, isovalues.size() - 1);
}

TEST(Plateaus, DoNotDependOnTheRangeOfTheSweep) {
    const Ball ball;
    std::vector<double> isovalues;
    for (const auto& [from, to, samples] : std::vector<std::tuple<double, double, int>>{
             {0, 90, 91}, {10, 90, 81}, {30, 90, 61}, {40, 62, 12}, {0, 90, 19}}) {
        const auto plateaus = ball.plateaus(from, to, samples, isovalues);
        ASSERT_EQ(plateaus.size(), 1u) << from;
        EXPECT_LE(isovalues[plateaus[0].first], std::max(from, 26.0)) << from;
        EXPECT_EQ(isovalues[plateaus[0].last], to) << from;
    }
    EXPECT_TRUE(ball.plateaus(0, 20, 41, isovalues).empty()) << "the slope, where the surface moves too far";
    EXPECT_TRUE(ball.plateaus(50, 60, 11, isovalues).empty()) << "too short to tell";
}

TEST(Plateaus, AreNotWhereAlmostNoSurfaceIsLeft) {
    const Ball ball;
    std::vector<double> isovalues;
    const auto plateaus = ball.plateaus(0, 900, 181, isovalues);
    ASSERT_EQ(plateaus.size(), 1u) << "the speck stays from 110 on, but is 8 samples of 32768";
    EXPECT_LE(isovalues[plateaus[0].last], 110);
}

TEST(Plateaus, NeedSurfacesAndContrast) {
    EXPECT_TRUE(find_plateaus({}, 1, 100).empty());
    EXPECT_TRUE(find_plateaus(std::vector<SweepSample>(9), 1, 100).empty());
    const std::vector<SweepSample> still{{0, 5, 10, 1, 8}, {50, 5, 10, 1, 8}};
    EXPECT_EQ(find_plateaus(still, 1, 100).size(), 1u);
    EXPECT_TRUE(find_plateaus(still, 1, 0).empty());
}

}  // namespace
}  // namespace marrow::test
