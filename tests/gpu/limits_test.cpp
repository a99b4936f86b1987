// What a device can do at once has limits. Tests lower them, and go to their edges.
#include <marrow/gpu.h>

#include <cstdlib>
#include <optional>
#include <vector>

#include "gpu/compare.h"
#include "gpu/device_extraction.h"

namespace marrow::test {
namespace {

constexpr std::uint64_t kSlice = 64 * 64 * 2;  // bytes of a slice of slices()

Volume slices(unsigned seed) {
    Random random(seed);
    return scan<std::int16_t>(grid(64, 64, 21), random);
}

TEST(GpuLimits, VolumesBeyondOneAllocationAreSplitBetweenSlices) {
    const Volume volume = slices(12);
    for (const std::uint64_t allocation :
         {3 * kSlice, 4 * kSlice - 1, 4 * kSlice, 4 * kSlice + 1, 21 * kSlice}) {
        for (const bool closed : {false, true}) {
            SCOPED_TRACE(allocation);
            const IsosurfaceOptions options{.closed = closed};
            std::optional<gpu::Extractor> extractor;
            {
                const SmallDevice small([&](auto& limits) { limits.allocation = allocation; });
                extractor.emplace(volume, options);
            }
            EXPECT_GT(compare(*extractor, volume, 60.5, options), 1000u);
        }
    }
    const SmallDevice small([](auto& limits) { limits.allocation = kSlice - 1; });
    EXPECT_THROW(gpu::Extractor{volume}, gpu::DeviceError);
}

TEST(GpuLimits, AResultMayFillAnAllocationButNotExceedIt) {
    const Volume volume = slices(13);
    const IsosurfaceOptions options;
    const Mesh mesh = extract_isosurface(volume, 60.5, options);
    const std::uint64_t bytes = std::max(mesh.points.size(), mesh.triangles.size()) * 12;
    gpu::Extractor extractor(volume, options);
    {
        const SmallDevice small([&](auto& limits) { limits.allocation = bytes - 1; });
        EXPECT_THROW(extractor.extract(60.5), gpu::DeviceError);
        EXPECT_THROW(extractor.extract_on_device(60.5), gpu::DeviceError);
    }
    const SmallDevice small([&](auto& limits) {
        limits.allocation = bytes;
        limits.staging = bytes / 2;
    });
    EXPECT_GT(compare(extractor, volume, 60.5, options), 1000u);
}

TEST(GpuLimits, ArraysHaveAsManyElementsAsAnIndexCanReach) {
    Random random(19);
    const Volume volume = scan<std::int16_t>(grid(128, 30, 7), random);
    constexpr std::uint64_t kWords = 4 * 30 * 7;  // of inside bits
    const IsosurfaceOptions options;
    std::optional<gpu::Extractor> extractor;
    {
        const SmallDevice small([](auto& limits) { limits.elements = kWords; });
        EXPECT_THROW(gpu::Extractor(volume, options), gpu::DeviceError);
    }
    {
        const SmallDevice small([](auto& limits) { limits.elements = kWords + 1; });
        extractor.emplace(volume, options);
        EXPECT_THROW(extractor->extract(60.5), gpu::DeviceError);
    }
    const std::uint64_t triangles = extract_isosurface(volume, 60.5, options).triangles.size();
    {
        const SmallDevice small([&](auto& limits) { limits.elements = triangles; });
        EXPECT_THROW(extractor->extract(60.5), gpu::DeviceError);
    }
    const SmallDevice small([&](auto& limits) { limits.elements = triangles + 1; });
    EXPECT_GT(compare(*extractor, volume, 60.5, options), kWords);
}

TEST(GpuLimits, FewWorkGroupsTakeAllElementsInTurn) {
    Random random(16);
    const Volume volume = scan<std::int16_t>(grid(100, 40, 21), random);
    for (const std::uint32_t groups : {1u, 3u}) {
        const SmallDevice small([&](auto& limits) { limits.groups = groups; });
        EXPECT_GT(compare(volume, {60.5, 20.5}), 2000u);
    }
}

TEST(GpuLimits, CopiesInPiecesHaveTheSameBytes) {
    const Volume volume = slices(20);
    // A row has 128 bytes, so it does not fit in the least of them.
    for (const std::uint64_t bytes : {100, 1000, 100000}) {
        const SmallDevice small([&](auto& limits) { limits.staging = bytes; });
        EXPECT_GT(compare(volume, {60.5}), 1000u);
    }
}

// The blocks of 32 x 8 samples of a slice with samples on both sides of an isovalue: 2,
// or all inside: 1, or outside: 0.
std::vector<int> states_of_blocks(const Volume& volume, std::int16_t isovalue) {
    const auto [nx, ny, nz] = volume.geometry().dims;
    const std::int16_t* samples = volume.samples<std::int16_t>();
    std::vector<int> states;
    for (std::int64_t z = 0; z < nz; ++z) {
        for (std::int64_t y = 0; y < ny; y += 8) {
            for (std::int64_t x = 0; x < nx; x += 32) {
                int inside = 0, all = 0;
                for (std::int64_t j = y; j < std::min(y + 8, ny); ++j) {
                    for (std::int64_t i = x; i < std::min(x + 32, nx); ++i, ++all)
                        inside += samples[(z * ny + j) * nx + i] >= isovalue;
                }
                states.push_back(inside == 0 ? 0 : inside == all ? 1 : 2);
            }
        }
    }
    return states;
}

TEST(GpuLimits, AnIsovalueReadsOnlyTheBlocksThatItCrosses) {
    const Volume volume = sampled<std::int16_t>(
        grid(150, 37, 40), [](auto x, auto y, auto z) { return 10 * std::hypot(x - 70, y - 20, z - 20); });
    gpu::internal::DeviceExtraction extraction(gpu::internal::open_device(0), volume, {});
    std::vector<int> before;
    for (const std::int16_t isovalue : {150, 152, 152, 400, 30000, 60}) {
        SCOPED_TRACE(isovalue);
        const std::vector<int> states = states_of_blocks(volume, isovalue);
        const auto mixed = std::count(states.begin(), states.end(), 2);
        std::int64_t listed = 0;
        for (std::size_t i = 0; i < states.size(); ++i)
            listed += states[i] == 2 || before.empty() || states[i] != before[i];
        const gpu::internal::Report report = extraction.extract(isovalue, false);
        EXPECT_EQ(report.status.mixed, mixed);
        EXPECT_EQ(report.status.listed, listed);
        EXPECT_LT(2 * mixed, static_cast<std::int64_t>(states.size()));
        before = states;
    }
}

// Takes 5 GiB of memory and some minutes.
TEST(GpuLimits, AVolumeOfMoreThanTwoGibibytesHasTheSameBytes) {
    if (std::getenv("MARROW_TEST_LONG") == nullptr) GTEST_SKIP() << "MARROW_TEST_LONG is not set";
    const Volume volume = sampled<std::uint8_t>(
        grid(1500, 1450, 1050), [](auto x, auto y, auto z) { return (x * 7 / 100 ^ y / 9 ^ z / 11) & 127; });
    ASSERT_GT(volume.bytes(), std::size_t{1} << 31);
    const IsosurfaceOptions options;
    gpu::Extractor extractor(volume, options);
    EXPECT_GT(compare(extractor, volume, 126.5, options), 1000000u);
}

}  // namespace
}  // namespace marrow::test
