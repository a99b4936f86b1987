// Allocates and copies the memory of devices.
#include "device_buffer.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include <marrow/gpu.h>

namespace marrow::gpu::internal {

DeviceBuffer::DeviceBuffer(std::shared_ptr<VulkanDevice> device, std::uint64_t bytes, Place place)
    : device_(std::move(device)), bytes_(bytes) {
    try {
        allocate(place);
    } catch (...) {
        destroy();
        throw;
    }
}

DeviceBuffer::~DeviceBuffer() {
    destroy();
}

void DeviceBuffer::allocate(Place place) {
    VkBufferCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO;
    info.size = bytes_;
    info.usage = VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT;
    if (place == Place::device)
        info.usage |= VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT;
    const VkDevice device = device_->handle();
    device_->check(vkCreateBuffer(device, &info, nullptr, &buffer_));
    VkMemoryRequirements needs;
    vkGetBufferMemoryRequirements(device, buffer_, &needs);
    // A larger allocation may still succeed on some drivers, and fails with this error on the others.
    if (needs.size > device_->limits().allocation) device_->check(VK_ERROR_OUT_OF_DEVICE_MEMORY);

    VkMemoryAllocateFlagsInfo flags{};
    flags.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_FLAGS_INFO;
    flags.flags = VK_MEMORY_ALLOCATE_DEVICE_ADDRESS_BIT;
    VkMemoryAllocateInfo allocation{};
    allocation.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO;
    allocation.pNext = place == Place::device ? &flags : nullptr;
    allocation.allocationSize = needs.size;
    allocation.memoryTypeIndex =
        place == Place::device
            ? device_->memory_type(needs.memoryTypeBits, 0, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT)
            : device_->memory_type(needs.memoryTypeBits,
                                   VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT,
                                   VK_MEMORY_PROPERTY_HOST_CACHED_BIT);
    device_->check(vkAllocateMemory(device, &allocation, nullptr, &memory_));
    device_->check(vkBindBufferMemory(device, buffer_, memory_, 0));
    if (place == Place::host) {
        void* memory = nullptr;
        device_->check(vkMapMemory(device, memory_, 0, VK_WHOLE_SIZE, 0, &memory));
        mapped_ = static_cast<std::byte*>(memory);
    } else {
        VkBufferDeviceAddressInfo address{};
        address.sType = VK_STRUCTURE_TYPE_BUFFER_DEVICE_ADDRESS_INFO;
        address.buffer = buffer_;
        address_ = vkGetBufferDeviceAddress(device, &address);
    }
}

void DeviceBuffer::destroy() {
    if (!device_) return;
    vkDestroyBuffer(device_->handle(), buffer_, nullptr);
    vkFreeMemory(device_->handle(), memory_, nullptr);
}

void DeviceBuffer::swap(DeviceBuffer& other) noexcept {
    std::swap(device_, other.device_);
    std::swap(buffer_, other.buffer_);
    std::swap(memory_, other.memory_);
    std::swap(bytes_, other.bytes_);
    std::swap(address_, other.address_);
    std::swap(mapped_, other.mapped_);
}

namespace {

constexpr std::uint64_t kPiece = std::uint64_t{64} << 20;

}  // namespace

Staging::Staging(std::shared_ptr<VulkanDevice> device) : device_(std::move(device)) {}

void Staging::reserve(std::uint64_t bytes) {
    if (memory_.bytes() < bytes) memory_ = DeviceBuffer(device_, bytes, DeviceBuffer::Place::host);
}

void Staging::upload(const DeviceBuffer& to, std::uint64_t unit,
                     const std::function<void(std::uint64_t, std::byte*)>& fill) {
    const std::uint64_t units = to.bytes() / unit, at_once = std::max<std::uint64_t>(1, kPiece / unit);
    reserve(std::min(units, at_once) * unit);
    for (std::uint64_t first = 0; first < units; first += at_once) {
        const std::uint64_t count = std::min(at_once, units - first);
        for (std::uint64_t k = 0; k < count; ++k) fill(first + k, memory_.mapped() + k * unit);
        device_->run([&](VkCommandBuffer commands) {
            const VkBufferCopy copy{0, first * unit, count * unit};
            vkCmdCopyBuffer(commands, memory_.handle(), to.handle(), 1, &copy);
            barrier(commands);
        });
    }
}

void Staging::download(const DeviceBuffer& from, std::uint64_t bytes, void* to) {
    reserve(std::min(bytes, kPiece));
    for (std::uint64_t begin = 0; begin < bytes; begin += kPiece) {
        const std::uint64_t count = std::min(kPiece, bytes - begin);
        device_->run([&](VkCommandBuffer commands) {
            const VkBufferCopy copy{begin, 0, count};
            vkCmdCopyBuffer(commands, from.handle(), memory_.handle(), 1, &copy);
            barrier(commands);
        });
        std::memcpy(static_cast<std::byte*>(to) + begin, memory_.mapped(), count);
    }
}

void barrier(VkCommandBuffer commands) {
    VkMemoryBarrier all{};
    all.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER;
    all.srcAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT | VK_ACCESS_SHADER_WRITE_BIT |
                        VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_TRANSFER_READ_BIT;
    all.dstAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT | VK_ACCESS_SHADER_WRITE_BIT |
                        VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_TRANSFER_READ_BIT | VK_ACCESS_HOST_READ_BIT;
    constexpr VkPipelineStageFlags kWork =
        VK_PIPELINE_STAGE_TRANSFER_BIT | VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT;
    vkCmdPipelineBarrier(commands, kWork, kWork | VK_PIPELINE_STAGE_HOST_BIT, 0, 1, &all, 0, nullptr, 0,
                         nullptr);
}

}  // namespace marrow::gpu::internal
