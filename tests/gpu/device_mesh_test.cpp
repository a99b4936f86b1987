// Surfaces that stay on the device: another device of Vulkan, made for the same
// hardware, imports their memory.
#include <marrow/gpu.h>

#include <unistd.h>

#include <cstring>
#include <memory>
#include <vector>

#include "gpu/commands.h"
#include "gpu/compare.h"
#include "gpu/device_buffer.h"

namespace marrow::test {
namespace {

using gpu::internal::Commands;
using gpu::internal::DeviceBuffer;
using gpu::internal::VulkanDevice;

// Memory of another device, and a buffer in it, as those who draw or compute with a mesh have them.
class Import {
  public:
    Import(const std::shared_ptr<VulkanDevice>& device, const gpu::DeviceArray& array)
        : device_(device), bytes_(array.bytes()) {
        constexpr auto kFd = VK_EXTERNAL_MEMORY_HANDLE_TYPE_OPAQUE_FD_BIT;
        VkExternalMemoryBufferCreateInfo external{};
        external.sType = VK_STRUCTURE_TYPE_EXTERNAL_MEMORY_BUFFER_CREATE_INFO;
        external.handleTypes = kFd;
        VkBufferCreateInfo buffer{};
        buffer.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO;
        buffer.pNext = &external;
        buffer.size = array.bytes();
        buffer.usage = VK_BUFFER_USAGE_TRANSFER_SRC_BIT;
        device->check(vkCreateBuffer(device->handle(), &buffer, nullptr, &buffer_));
        VkMemoryRequirements needs;
        vkGetBufferMemoryRequirements(device->handle(), buffer_, &needs);
        VkImportMemoryFdInfoKHR import{};
        import.sType = VK_STRUCTURE_TYPE_IMPORT_MEMORY_FD_INFO_KHR;
        import.handleType = kFd;
        import.fd = array.export_fd();  // which the import takes over
        VkMemoryAllocateInfo memory{};
        memory.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO;
        memory.pNext = &import;
        memory.allocationSize = array.allocation();
        memory.memoryTypeIndex =
            device->memory_type(needs.memoryTypeBits, 0, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
        device->check(vkAllocateMemory(device->handle(), &memory, nullptr, &memory_));
        device->check(vkBindBufferMemory(device->handle(), buffer_, memory_, 0));
    }
    ~Import() {
        vkDestroyBuffer(device_->handle(), buffer_, nullptr);
        vkFreeMemory(device_->handle(), memory_, nullptr);
    }
    Import(const Import&) = delete;
    Import& operator=(const Import&) = delete;

    std::vector<std::byte> read() const {
        const DeviceBuffer host(device_, bytes_, DeviceBuffer::Place::host);
        Commands(device_).run([&](VkCommandBuffer commands) {
            VkBufferMemoryBarrier acquire{};
            acquire.sType = VK_STRUCTURE_TYPE_BUFFER_MEMORY_BARRIER;
            acquire.dstAccessMask = VK_ACCESS_TRANSFER_READ_BIT;
            acquire.srcQueueFamilyIndex = VK_QUEUE_FAMILY_EXTERNAL;
            acquire.dstQueueFamilyIndex = device_->queue_family();
            acquire.buffer = buffer_;
            acquire.size = VK_WHOLE_SIZE;
            vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_TOP_OF_PIPE_BIT, VK_PIPELINE_STAGE_TRANSFER_BIT,
                                 0, 0, nullptr, 1, &acquire, 0, nullptr);
            const VkBufferCopy region{0, 0, bytes_};
            vkCmdCopyBuffer(commands, buffer_, host.handle(), 1, &region);
            barrier(commands, gpu::internal::kCopy, gpu::internal::kHost);
        });
        return {host.mapped(), host.mapped() + bytes_};
    }

  private:
    std::shared_ptr<VulkanDevice> device_;
    std::uint64_t bytes_;
    VkBuffer buffer_ = VK_NULL_HANDLE;
    VkDeviceMemory memory_ = VK_NULL_HANDLE;
};

std::shared_ptr<VulkanDevice> another_device() {
    return std::make_shared<VulkanDevice>(gpu::internal::usable_devices().at(0));
}

template <class T>
void expect_bytes(const std::vector<std::byte>& bytes, const Buffer<T>& expected) {
    ASSERT_EQ(bytes.size(), expected.size() * sizeof(T));
    EXPECT_EQ(std::memcmp(bytes.data(), expected.data(), bytes.size()), 0);
}

TEST(GpuDeviceMesh, AnotherDeviceImportsTheBytesOfTheCpu) {
    Random random(30);
    const Volume volume = scan<std::int16_t>(oblique(70, 23, 11), random);
    for (const bool closed : {false, true}) {
        const IsosurfaceOptions options{.closed = closed};
        gpu::Extractor extractor(volume, options);
        for (const double isovalue : {90.0, 60.0, 70.0}) {
            const Mesh expected = extract_isosurface(volume, isovalue, options);
            const gpu::DeviceMesh& mesh = extractor.extract_on_device(isovalue);
            ASSERT_EQ(mesh.points, expected.points.size());
            ASSERT_EQ(mesh.triangles, expected.triangles.size());
            const auto device = another_device();
            expect_bytes(Import(device, mesh.positions).read(), expected.points);
            expect_bytes(Import(device, mesh.normals).read(), expected.normals);
            expect_bytes(Import(device, mesh.indices).read(), expected.triangles);
        }
        EXPECT_GT(compare(extractor, volume, 60, options), 100u);  // to the host again
    }
}

TEST(GpuDeviceMesh, ImportedMemoryOutlivesTheExtractorAndGetsItsNextSurfaces) {
    Random random(31);
    const Volume volume = scan<std::int16_t>(grid(40, 20, 9), random);
    auto extractor = std::make_unique<gpu::Extractor>(volume);
    const gpu::DeviceArray large = extractor->extract_on_device(60).positions;
    const auto device = another_device();
    const Import import(device, large);
    const gpu::DeviceArray small = extractor->extract_on_device(100).positions;
    EXPECT_EQ(small.id(), large.id());
    EXPECT_LT(small.bytes(), large.bytes());
    extractor.reset();
    std::vector<std::byte> bytes = import.read();
    bytes.resize(small.bytes());
    expect_bytes(bytes, extract_isosurface(volume, 100).points);
}

TEST(GpuDeviceMesh, ArraysMoveOnlyToGrow) {
    Random random(32);
    const Volume volume = scan<std::int16_t>(grid(40, 20, 9), random);
    gpu::Extractor extractor(volume);
    const gpu::DeviceMesh small = extractor.extract_on_device(115);
    const gpu::DeviceMesh large = extractor.extract_on_device(60);
    ASSERT_LT(2 * small.points, large.points);
    EXPECT_NE(small.positions.id(), large.positions.id());
    EXPECT_LE(large.positions.bytes(), large.positions.allocation());
}

TEST(GpuDeviceMesh, ArraysThatAreEmptyHaveNoMemory) {
    Random random(33);
    const Volume volume = scan<std::int16_t>(grid(40, 20, 9), random);
    gpu::Extractor extractor(volume, {.normals = false});
    const gpu::DeviceMesh& mesh = extractor.extract_on_device(60);
    EXPECT_GT(mesh.positions.bytes(), 0u);
    EXPECT_EQ(mesh.normals.bytes(), 0u);
    EXPECT_THROW(mesh.normals.export_fd(), InputError);
    EXPECT_EQ(extractor.extract_on_device(1000).points, 0u);
    EXPECT_EQ(mesh.positions.bytes(), 0u);
    EXPECT_EQ(mesh.positions.allocation(), 0u);
    EXPECT_THROW(mesh.positions.export_fd(), InputError);
}

TEST(GpuDeviceMesh, DevicesThatCannotExportMemorySaySo) {
    Random random(34);
    const Volume volume = scan<std::int16_t>(grid(40, 20, 9), random);
    const SmallDevice small([](auto& limits) { limits.exports_memory = false; });
    gpu::Extractor extractor(volume);
    EXPECT_THROW(extractor.extract_on_device(60).positions.export_fd(), gpu::DeviceError);
    EXPECT_GT(compare(extractor, volume, 60, {}), 100u);
}

}  // namespace
}  // namespace marrow::test
