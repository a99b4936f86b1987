// A device extracts the same meshes as the CPU, to the last bit.
#include <marrow/gpu.h>

#include <cstdlib>
#include <limits>
#include <numbers>
#include <thread>
#include <vector>

#include "gpu/compare.h"

namespace marrow::test {
namespace {

TEST(GpuExtractor, GivesTheSameBytesForEveryType) {
    Random random(1);
    const Geometry g = oblique(70, 23, 11);
    const auto isovalues = {60.0, 60.4, 17.25, 101.0};
    EXPECT_GT(compare(scan<std::int16_t>(g, random), isovalues), 5000u);
    EXPECT_GT(compare(scan<std::uint16_t>(g, random), isovalues), 5000u);
    EXPECT_GT(compare(scan<std::int8_t>(g, random), isovalues), 5000u);
    EXPECT_GT(compare(scan<std::uint8_t>(g, random), isovalues), 5000u);
    EXPECT_GT(compare(scan<float>(g, random), isovalues), 5000u);
}

TEST(GpuExtractor, GivesTheSameBytesForSamplesThatStandForOtherValues) {
    Random random(21);
    Volume volume = scan<std::int16_t>(oblique(70, 23, 11), random);
    volume.set_rescale({0.37, -2643.4});
    const auto value = [&](double sample) { return volume.rescale().value(sample); };
    EXPECT_GT(compare(volume, {value(60), value(60.4), value(17.25), value(101)}), 5000u);
}

TEST(GpuExtractor, GivesTheSameBytesForIsovaluesInAnyOrder) {
    Random random(15);
    const Volume integers = scan<std::int16_t>(oblique(70, 23, 11), random);
    Volume floats = scan<float>(grid(70, 23, 11), random);
    for (int i = 0; i < 10; ++i)
        floats.samples<float>()[random() % 10000] = std::numeric_limits<float>::quiet_NaN();
    for (const Volume* volume : std::initializer_list<const Volume*>{&integers, &floats}) {
        const IsosurfaceOptions options{.closed = volume == &floats};
        gpu::Extractor extractor(*volume, options);
        double isovalue = 60;
        for (int i = 0; i < 30; ++i) {
            // Small steps as from a slider, jumps, and values beyond all samples.
            isovalue = random() % 3 == 0 ? static_cast<double>(random() % 200) * 1.37 - 60 : isovalue * 1.03;
            compare(extractor, *volume, isovalue, options);
            ASSERT_FALSE(HasFailure()) << "at " << isovalue;
        }
    }
}

TEST(GpuExtractor, GivesTheSameBytesForRowsOfAnyLength) {
    Random random(2);
    for (const std::int64_t nx : {2, 31, 32, 33, 63, 64, 65, 127, 128, 129}) {
        SCOPED_TRACE(nx);
        EXPECT_GT(compare(scan<std::int16_t>(grid(nx, 5, 4), random), {70.0}), 0u);
    }
}

TEST(GpuExtractor, GivesTheSameBytesInMirroredSpace) {
    Random random(3);
    Geometry g = oblique(40, 20, 9);
    for (Vec3d& row : g.direction) row[1] = -row[1];
    EXPECT_GT(compare(scan<std::int16_t>(g, random), {60.5}), 500u);
}

TEST(GpuExtractor, GivesTheSameBytesWhereCosinesAreNearlyZero) {
    Random random(4);
    Geometry g = grid(34, 20, 9);
    const double half_pi = std::numbers::pi / 2, c = std::cos(half_pi), s = std::sin(half_pi);  // c is 6e-17
    g.direction = {{{c, -s, 0}, {s * c, c * c, -s}, {s * s, c * s, c}}};
    EXPECT_GT(compare(scan<std::int16_t>(g, random), {60.5}), 500u);
}

TEST(GpuExtractor, GivesTheSameBytesForTiesAndBoards) {
    Random random(5);
    EXPECT_GT(compare(ties_at_isovalue(grid(35, 9, 8), 40, random), {40.0}), 500u);
    EXPECT_GT(compare(checkerboard(12), {0.5, 1.0}), 500u);
    EXPECT_GT(compare(one_voxel_thick_wall(12), {500.0, 1000.0}), 100u);
}

TEST(GpuExtractor, GivesTheSameBytesAroundSamplesThatAreNotFinite) {
    Random random(6);
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    const float special[] = {kInfinity, -kInfinity, std::numeric_limits<float>::quiet_NaN(), 0.0f, -0.0f};
    const Volume volume = sampled<float>(grid(37, 21, 17), [&](auto, auto, auto) {
        return random() % 8 == 0 ? special[random() % 5] : static_cast<float>(random() % 7) - 3;
    });
    EXPECT_GT(compare(volume, {0.0, 0.7, -2.0}), 10000u);
}

TEST(GpuExtractor, GivesTheSameBytesForSteepAndFlatGradients) {
    Random random(7);
    for (const double scale : {0x1p-70, 0x1p-60, 0x1p-30, 0x1p40, 0x1p55, 0x1p100}) {
        SCOPED_TRACE(scale);
        Volume volume = scan<float>(oblique(20, 9, 8), random);
        float* samples = volume.samples<float>();
        for (std::int64_t i = 0; i < volume.geometry().sample_count(); ++i)
            samples[i] = static_cast<float>(samples[i] * scale);
        EXPECT_GT(compare(volume, {60.3 * scale}), 100u);
    }
}

TEST(GpuExtractor, EmptyAndFullVolumesHaveTheSameSurfacesAsOnTheCpu) {
    const auto constant = [](auto value) {
        return sampled<decltype(value)>(grid(33, 4, 3), [=](auto, auto, auto) { return value; });
    };
    EXPECT_GT(compare(constant(std::int16_t{100}), {-1e300, -32768.0, 100.0, 100.5, 32767.0, 32768.0, 1e300}),
              0u);
    EXPECT_GT(compare(constant(std::uint8_t{255}), {-1.0, 0.0, 255.0, 255.5}), 0u);
    EXPECT_GT(compare(constant(1.5f), {-1e300, 1.5, 1.6, 1e300}), 0u);
}

TEST(GpuExtractor, OneSampleRowOrSliceHasASurfaceWhenClosed) {
    Random random(8);
    for (const Geometry& g : {grid(1, 1, 1), grid(40, 1, 1), grid(1, 40, 1), grid(33, 17, 1), grid(1, 9, 12)})
        EXPECT_GT(compare(scan<std::uint8_t>(g, random), {0.0, 10.0}), 0u);
    EXPECT_EQ(compare(Volume(grid(0, 5, 5), SampleType::int16), {1.0}), 0u);
}

TEST(GpuExtractor, NormalsCanBeLeftOut) {
    Random random(9);
    const Volume volume = scan<std::int16_t>(grid(35, 12, 9), random);
    const IsosurfaceOptions options{.normals = false};
    gpu::Extractor extractor(volume, options);
    EXPECT_GT(compare(extractor, volume, 60.5, options), 100u);
}

TEST(GpuExtractor, APartHasTheBytesOfThePartOnTheCpu) {
    Random random(10);
    const Volume volume = scan<std::int16_t>(oblique(100, 20, 15), random);
    EXPECT_GT(compare(part_of(volume, {33, 4, 3}, {41, 9, 7}), {60.5}), 100u);
    EXPECT_GT(compare(part_of(volume, {0, 0, 8}, {64, 20, 7}), {60.5}), 100u);
    EXPECT_GT(compare(part_of(volume, {36, 10, 0}, {64, 1, 15}), {60.5}), 10u);
}

// Whether samples are so small or large that a device may refuse them.
bool has_extreme_samples(const Volume& volume) {
    if (volume.type() != SampleType::float32) return false;
    const float* samples = volume.samples<float>();
    return std::any_of(samples, samples + volume.geometry().sample_count(), [](float sample) {
        const float size = std::abs(sample);
        return std::isfinite(size) && size != 0 && (size < 0x1p-100f || size > 0x1p125f);
    });
}

// Samples of few values, of which many are the isovalue 3; or all of one value.
template <class T>
Volume few_values(const Geometry& g, Random& random) {
    switch (random() % 6) {
        case 0:
            return sampled<T>(g, [](auto, auto, auto) { return 2; });
        case 1:
            return sampled<T>(g, [](auto, auto, auto) { return 4; });
        case 2:
            return sampled<T>(g, [&](auto, auto, auto) {
                return random() % 2 == 0 ? std::numeric_limits<T>::max()
                                         : std::numeric_limits<T>::lowest() / 2;
            });
        case 3:
            return sampled<T>(g, [&](auto, auto, auto) {
                const bool none = std::is_same_v<T, float> && random() % 8 == 0;
                return none ? std::numeric_limits<T>::quiet_NaN() : static_cast<T>(random() % 7);
            });
        default:
            return sampled<T>(g, [&](auto, auto, auto) { return random() % 7; });
    }
}

// A grid of 1 to 9 samples a side, or more along x, some of them oblique or mirrored.
Geometry small_geometry(Random& random) {
    const auto side = [&] { return static_cast<std::int64_t>(1 + random() % 9); };
    const auto nx = random() % 4 == 0 ? static_cast<std::int64_t>(28 + random() % 40) : side();
    Geometry g = random() % 2 == 0 ? oblique(nx, side(), side()) : grid(nx, side(), side());
    if (random() % 4 == 0) {
        for (Vec3d& row : g.direction) row[1] = -row[1];
    }
    return g;
}

Volume small_volume(Random& random) {
    const Geometry g = small_geometry(random);
    switch (random() % 5) {
        case 0:
            return few_values<std::uint8_t>(g, random);
        case 1:
            return few_values<std::int8_t>(g, random);
        case 2:
            return few_values<std::uint16_t>(g, random);
        case 3:
            return few_values<std::int16_t>(g, random);
        default:
            return few_values<float>(g, random);
    }
}

// MARROW_TEST_GRIDS of them.
TEST(GpuExtractor, ManySmallGridsHaveTheSameBytes) {
    Random random(11);
    const char* const number = std::getenv("MARROW_TEST_GRIDS");
    const int grids = number == nullptr ? 1000 : std::atoi(number);
    std::size_t points = 0;
    for (int i = 0; i < grids; ++i) {
        RandomGrid drawn = i % 2 == 0 ? random_grid(random) : RandomGrid{small_volume(random), 3};
        const SampleType type = drawn.volume.type();
        if (type == SampleType::int32 || type == SampleType::float64) drawn = {small_volume(random), 3};
        const IsosurfaceOptions options{.closed = i % 3 == 0};
        try {
            gpu::Extractor extractor(drawn.volume, options);
            points += compare(extractor, drawn.volume, drawn.isovalue, options);
        } catch (const gpu::DeviceError& error) {
            EXPECT_TRUE(has_extreme_samples(drawn.volume)) << error.what();
        }
        ASSERT_FALSE(HasFailure()) << "grid " << i;
    }
    EXPECT_GT(points, 100u * static_cast<std::size_t>(grids));
}

TEST(GpuExtractor, DevicesThatDoNotControlRoundingHaveTheSameBytes) {
    Random random(18);
    const Volume volume = scan<std::int16_t>(oblique(70, 20, 9), random);
    const SmallDevice small([](auto& limits) { limits.float_controls = false; });
    EXPECT_GT(compare(volume, {60.5}), 1000u);
}

TEST(GpuExtractor, ExtractorsOfSeveralThreadsDoNotDisturbEachOther) {
    std::vector<std::thread> threads;
    for (unsigned seed = 20; seed < 23; ++seed) {
        threads.emplace_back([seed] {
            Random random(seed);
            for (int i = 0; i < 5; ++i) compare(scan<std::int16_t>(grid(40, 15, 9), random), {50.5, 70.0});
        });
    }
    for (std::thread& thread : threads) thread.join();
}

TEST(GpuExtractor, RefusesWhatTheDeviceCannotDo) {
    const Volume bytes(grid(4, 4, 4), SampleType::uint8);
    const Volume integers(grid(4, 4, 4), SampleType::int32), doubles(grid(4, 4, 4), SampleType::float64);
    EXPECT_THROW(gpu::Extractor{integers}, gpu::DeviceError);
    EXPECT_THROW(gpu::Extractor{doubles}, gpu::DeviceError);
    EXPECT_THROW(gpu::Extractor(bytes, {.snap = 0.2}), gpu::DeviceError);
    EXPECT_THROW(gpu::Extractor(bytes, {.topology = true}), gpu::DeviceError);
    EXPECT_THROW(gpu::Extractor(bytes, {.snap = 0.7}), InputError);
    EXPECT_THROW(gpu::Extractor(bytes, {.snap = std::numeric_limits<double>::quiet_NaN()}), InputError);
    EXPECT_THROW(gpu::Extractor(bytes, {.snap = 0.2, .topology = true}), InputError);
    EXPECT_THROW(gpu::Extractor(bytes, {}, 99), gpu::DeviceError);
    EXPECT_THROW(gpu::Extractor(VolumeView(static_cast<const float*>(nullptr), grid(4, 4, 4))), InputError);
    EXPECT_THROW(gpu::Extractor(bytes).extract(std::numeric_limits<double>::quiet_NaN()), InputError);
}

TEST(GpuExtractor, RefusesNumbersThatTheDeviceMayRoundInOtherWays) {
    const auto slope = [](float scale) {
        return sampled<float>(grid(4, 4, 4),
                              [=](auto x, auto, auto) { return scale * static_cast<float>(x); });
    };
    // The differences are denormal, or overflow.
    const Volume denormal = slope(1e-40f), huge = slope(1e38f);
    EXPECT_THROW(gpu::Extractor(denormal).extract(1.5e-40), gpu::DeviceError);
    EXPECT_THROW(gpu::Extractor(huge).extract(1.5e38), gpu::DeviceError);
}

// The square of the least part of this gradient is denormal, so that a device may take it for zero. It
// decides how the sum is rounded all the same, because the sum is so small.
TEST(GpuExtractor, RefusesGradientsWhoseLeastSquareADeviceMayDrop) {
    const float x_step = std::ldexp(31.0f / 32, -63), y_step = std::ldexp(1.4375f, -65);
    const float z_step = std::ldexp(1 + 57.0f / 16384, -51);
    const Volume volume = sampled<float>(grid(8, 8, 8), [=](auto x, auto y, auto z) {
        return z_step * static_cast<float>(z - 3) + x_step * static_cast<float>(x) +
               y_step * static_cast<float>(y);
    });
    gpu::Extractor extractor(volume);
    EXPECT_THROW(compare(extractor, volume, 0.5 * z_step, {}), gpu::DeviceError);
}

TEST(GpuExtractor, CountsMoreSamplesThatAreNotFiniteThan32BitsCan) {
    const Volume volume = sampled<float>(grid(33, 9, 8), [](auto x, auto, auto) {
        return x % 2 == 0 ? std::numeric_limits<float>::infinity() : static_cast<float>(x);
    });
    gpu::internal::open_device(0);
    static const auto original = vkCmdFillBuffer;
    // As if 2^32 - 1 had been counted before.
    vkCmdFillBuffer = [](VkCommandBuffer commands, VkBuffer buffer, VkDeviceSize begin, VkDeviceSize size,
                         std::uint32_t data) {
        if (begin == 0) original(commands, buffer, 0, 4, 0xffffffffu);
        original(commands, buffer, begin == 0 ? 4 : begin, size, data);
    };
    gpu::Extractor extractor(volume);
    vkCmdFillBuffer = original;
    IsosurfaceStats stats;
    extractor.extract(2, &stats);
    EXPECT_EQ(stats.non_finite_samples, std::int64_t{0xffffffff} + 17 * 9 * 8);
}

TEST(GpuExtractor, CanBeCancelledAndUsedAgain) {
    Random random(14);
    const Volume volume = scan<std::int16_t>(grid(35, 12, 9), random);
    double last = 0;
    bool cancel = false;
    const IsosurfaceOptions options{.progress = [&](double fraction) {
        EXPECT_TRUE(cancel || fraction >= last || last == 1) << fraction << " after " << last;
        last = fraction;
        return !cancel;
    }};
    gpu::Extractor extractor(volume, options);
    EXPECT_EQ(last, 1);
    cancel = true;
    EXPECT_THROW(extractor.extract(60.5), Cancelled);
    EXPECT_THROW(gpu::Extractor(volume, options), Cancelled);
    cancel = false;
    last = 0;
    EXPECT_GT(compare(extractor, volume, 60.5, {}), 100u);
    EXPECT_EQ(last, 1);
}

TEST(GpuDevices, AreNamed) {
    const std::vector<gpu::Device> devices = gpu::devices();
    ASSERT_FALSE(devices.empty());
    EXPECT_FALSE(devices[0].name.empty());
    EXPECT_GT(devices[0].memory, std::uint64_t{1} << 28);
}

}  // namespace
}  // namespace marrow::test
