// The extractor gives the CPU's mesh on the device, and after the device has failed.
// The tests use the first device.
#include <gtest/gtest.h>

#include <marrow/gpu.h>

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "gpu/vulkan_device.h"
#include "support/fields.h"
#include "support/mesh_checks.h"

namespace marrow::test {
namespace {

template <class T>
Volume ball(T scale = 1) {
    return sampled<T>(grid(24, 20, 16), [=](auto x, auto y, auto z) {
        const double value = 100 - 10 * std::hypot(x - 12, y - 10, z - 8);
        return scale * static_cast<T>(std::max(0.0, value));
    });
}

const IsosurfaceOptions kClosed{.closed = true};

void expect_mesh_of_cpu(gpu::FallbackExtractor& extractor, const Volume& volume, double isovalue,
                        const IsosurfaceOptions& options = kClosed, int level = 0) {
    Mesh expected;
    IsosurfaceExtractor(volume, options).extract(isovalue, expected, level);
    EXPECT_GT(expected.triangles.size(), 100u);
    EXPECT_EQ(mesh_hash(extractor.extract(isovalue, level)), mesh_hash(expected));
}

TEST(FallbackExtractor, ExtractsOnTheDevice) {
    const Volume volume = ball<std::int16_t>();
    gpu::FallbackExtractor extractor(volume, kClosed, 0);
    expect_mesh_of_cpu(extractor, volume, 30.5);
    expect_mesh_of_cpu(extractor, volume, 40.5);
    expect_mesh_of_cpu(extractor, volume, 30.5, kClosed, 1);  // a preview
    EXPECT_TRUE(extractor.on_device());
    EXPECT_EQ(extractor.failure(), "");
}

TEST(FallbackExtractor, ExtractsOnTheCpuWithoutADevice) {
    const Volume volume = ball<std::int16_t>();
    gpu::FallbackExtractor extractor(volume, kClosed, {});
    expect_mesh_of_cpu(extractor, volume, 30.5);
    EXPECT_FALSE(extractor.on_device());
    EXPECT_EQ(extractor.failure(), "");
}

TEST(FallbackExtractor, TheCpuTakesWhatTheDeviceCannot) {
    const Volume integers = ball<std::int32_t>(), bytes = ball<std::uint8_t>();
    gpu::FallbackExtractor of_integers(integers, kClosed, 0);
    expect_mesh_of_cpu(of_integers, integers, 30.5);
    EXPECT_FALSE(of_integers.on_device());
    EXPECT_EQ(of_integers.failure(), "GPUs take no samples of type int32");

    const IsosurfaceOptions snapping{.closed = true, .snap = 0.3};
    gpu::FallbackExtractor snapped(bytes, snapping, 0);
    expect_mesh_of_cpu(snapped, bytes, 30.5, snapping);
    EXPECT_FALSE(snapped.on_device());

    gpu::FallbackExtractor elsewhere(bytes, kClosed, 99);
    expect_mesh_of_cpu(elsewhere, bytes, 30.5);
    EXPECT_FALSE(elsewhere.on_device());
}

TEST(FallbackExtractor, TheCpuTakesOverWhenTheDeviceIsLost) {
    const Volume volume = ball<std::int16_t>();
    gpu::FallbackExtractor extractor(volume, kClosed, 0);
    expect_mesh_of_cpu(extractor, volume, 30.5);
    EXPECT_THROW(gpu::internal::open_device(0)->check(VK_ERROR_DEVICE_LOST), gpu::DeviceError);
    expect_mesh_of_cpu(extractor, volume, 40.5);
    EXPECT_FALSE(extractor.on_device());
    EXPECT_EQ(extractor.failure(), "the device was lost");
    expect_mesh_of_cpu(extractor, volume, 30.5);
}

TEST(FallbackExtractor, TheCpuTakesOverWhereTheDeviceMayRoundInOtherWays) {
    const Volume denormal = ball<float>(1e-42f);
    gpu::FallbackExtractor extractor(denormal, kClosed, 0);
    EXPECT_TRUE(extractor.on_device());
    expect_mesh_of_cpu(extractor, denormal, 30.5e-42);
    EXPECT_FALSE(extractor.on_device());
}

TEST(FallbackExtractor, ProgressNeverDecreasesWhenTheCpuTakesOver) {
    const Volume denormal = ball<float>(1e-42f);
    std::vector<double> fractions;
    const IsosurfaceOptions options{.closed = true, .progress = [&](double fraction) {
                                        fractions.push_back(fraction);
                                        return true;
                                    }};
    gpu::FallbackExtractor extractor(denormal, options, 0);
    for (const bool on_device : {true, false}) {
        EXPECT_EQ(extractor.on_device(), on_device);
        fractions.clear();
        extractor.extract(30.5e-42);
        EXPECT_TRUE(std::is_sorted(fractions.begin(), fractions.end())) << testing::PrintToString(fractions);
        EXPECT_LT(fractions.front(), 0.5);
        EXPECT_EQ(fractions.back(), 1);
    }
}

// Runs `work` in a forked process. Returns what it does, or -1 if it does not end in a minute.
template <class Work>
int in_forked_process(const Work& work) {
    const pid_t child = fork();
    if (child == 0) {
        alarm(60);
        _exit(work());
    }
    int status = 0;
    waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

TEST(FallbackExtractor, TheCpuTakesOverInAForkedProcess) {
    const Volume volume = ball<std::int16_t>();
    // The other threads of the CPU do not survive either.
    const IsosurfaceOptions one_thread{.closed = true, .threads = 1};
    const std::uint64_t expected = mesh_hash(extract_isosurface(volume, 30.5, one_thread));
    std::optional<gpu::FallbackExtractor> inherited;
    inherited.emplace(volume, one_thread, 0);
    EXPECT_EQ(mesh_hash(inherited->extract(30.5)), expected);
    EXPECT_TRUE(inherited->on_device());
    const auto extracts_on_cpu = [&](gpu::FallbackExtractor& extractor) {
        return mesh_hash(extractor.extract(30.5)) == expected && !extractor.on_device() &&
               extractor.failure() == "devices do not survive a fork";
    };
    EXPECT_EQ(in_forked_process([&] { return extracts_on_cpu(*inherited) ? 0 : 1; }), 0);
    EXPECT_EQ(in_forked_process([&] {
                  gpu::FallbackExtractor made(volume, one_thread, 0);
                  return extracts_on_cpu(made) ? 0 : 1;
              }),
              0);
    // What the child destroys is not the parent's.
    EXPECT_EQ(in_forked_process([&] {
                  inherited.reset();
                  return 0;
              }),
              0);
    EXPECT_EQ(mesh_hash(inherited->extract(30.5)), expected);
    EXPECT_TRUE(inherited->on_device());
}

TEST(FallbackExtractor, OtherErrorsAreNotTheDevices) {
    const Volume volume = ball<std::int16_t>();
    bool cancel = false;
    const IsosurfaceOptions options{.closed = true, .progress = [&](double) { return !cancel; }};
    gpu::FallbackExtractor extractor(volume, options, 0);
    EXPECT_THROW(extractor.extract(std::numeric_limits<double>::quiet_NaN()), InputError);
    EXPECT_THROW(extractor.extract(30.5, 31), InputError);
    cancel = true;
    EXPECT_THROW(extractor.extract(30.5), Cancelled);
    cancel = false;
    expect_mesh_of_cpu(extractor, volume, 30.5);
    EXPECT_TRUE(extractor.on_device());
    EXPECT_THROW(gpu::FallbackExtractor(VolumeView(static_cast<const float*>(nullptr), grid(4, 4, 4)), {}, 0),
                 InputError);
}

TEST(Devices, AreDescribed) {
    const gpu::Device device = gpu::devices().at(0);
    EXPECT_EQ(device.kind, gpu::DeviceKind::software);
    EXPECT_TRUE(device.driver.starts_with("llvmpipe Mesa ")) << device.driver;
    EXPECT_TRUE(gpu::unusable_devices().empty());
    EXPECT_EQ(gpu::choose_device("auto"), std::nullopt);
    EXPECT_EQ(gpu::choose_device("LLVMpipe"), 0u);
}

TEST(Devices, HaveNoMemoryOfTheHost) {
    const std::uint64_t memory = gpu::devices().at(0).memory;
    EXPECT_GT(memory, 0u);
    static const auto original = vkGetPhysicalDeviceMemoryProperties;
    vkGetPhysicalDeviceMemoryProperties = [](VkPhysicalDevice device,
                                             VkPhysicalDeviceMemoryProperties* properties) {
        original(device, properties);
        properties->memoryHeaps[properties->memoryHeapCount++] = {2 * properties->memoryHeaps[0].size, 0};
    };
    EXPECT_EQ(gpu::devices().at(0).memory, memory);
    vkGetPhysicalDeviceMemoryProperties = original;
}

}  // namespace
}  // namespace marrow::test
