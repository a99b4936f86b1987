// What is built without Vulkan has no devices, says so, and uses the CPU.
#include <gtest/gtest.h>

#include <marrow/gpu.h>

#include "support/fields.h"
#include "support/mesh_checks.h"

namespace marrow::test {
namespace {

std::string refusal(std::string_view choice) {
    try {
        gpu::choose_device(choice);
    } catch (const gpu::DeviceError& error) {
        return error.what();
    }
    return "none";
}

TEST(WithoutVulkan, ThereAreNoDevices) {
    EXPECT_TRUE(gpu::devices().empty());
    EXPECT_TRUE(gpu::unusable_devices().empty());
    EXPECT_EQ(gpu::choose_device("cpu"), std::nullopt);
    EXPECT_EQ(gpu::choose_device("auto"), std::nullopt);
    EXPECT_EQ(refusal("gpu"), "there is no GPU: Marrow was built without Vulkan (MARROW_GPU)");
    EXPECT_EQ(refusal("0"), "there is no device '0': Marrow was built without Vulkan (MARROW_GPU)");
}

TEST(WithoutVulkan, TheCpuExtracts) {
    const Volume volume = checkerboard(6);
    EXPECT_THROW(gpu::Extractor{volume}, gpu::DeviceError);
    for (const std::optional<std::size_t> device :
         {std::optional<std::size_t>(), std::optional<std::size_t>(0)}) {
        gpu::FallbackExtractor extractor(volume, {}, device);
        EXPECT_EQ(mesh_hash(extractor.extract(0.5)), mesh_hash(extract_isosurface(volume, 0.5)));
        EXPECT_FALSE(extractor.on_device());
    }
}

}  // namespace
}  // namespace marrow::test
