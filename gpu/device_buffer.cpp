// Allocates the memory of devices.
#include "device_buffer.h"

#include <atomic>
#include <utility>

#include <marrow/gpu.h>

namespace marrow::gpu::internal {

namespace {

constexpr VkExternalMemoryHandleTypeFlagBits kFd = VK_EXTERNAL_MEMORY_HANDLE_TYPE_OPAQUE_FD_BIT;

std::uint64_t next_id() {
    static std::atomic<std::uint64_t> last = 0;
    return ++last;
}

}  // namespace

DeviceBuffer::DeviceBuffer(std::shared_ptr<VulkanDevice> device, std::uint64_t bytes, Place place)
    : device_(std::move(device)), bytes_(bytes), id_(next_id()) {
    try {
        create(place);
    } catch (...) {
        destroy();
        throw;
    }
}

DeviceBuffer::~DeviceBuffer() {
    destroy();
}

void DeviceBuffer::create(Place place) {
    VkExternalMemoryBufferCreateInfo external{};
    external.sType = VK_STRUCTURE_TYPE_EXTERNAL_MEMORY_BUFFER_CREATE_INFO;
    external.handleTypes = kFd;
    VkBufferCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO;
    info.pNext = place == Place::shared && device_->limits().exports_memory ? &external : nullptr;
    info.size = bytes_;
    info.usage = place == Place::host ? VulkanDevice::kHostUsage : VulkanDevice::kDeviceUsage;
    // A larger buffer or allocation may still succeed on some drivers, and fails
    // with this error on the others.
    if (bytes_ > device_->limits().allocation) device_->check(VK_ERROR_OUT_OF_DEVICE_MEMORY);
    const VkDevice device = device_->handle();
    device_->check(vkCreateBuffer(device, &info, nullptr, &buffer_));
    VkMemoryRequirements needs;
    vkGetBufferMemoryRequirements(device, buffer_, &needs);
    allocate(needs, place);
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

void DeviceBuffer::allocate(const VkMemoryRequirements& needs, Place place) {
    VkExportMemoryAllocateInfo exported{};
    exported.sType = VK_STRUCTURE_TYPE_EXPORT_MEMORY_ALLOCATE_INFO;
    exported.handleTypes = kFd;
    VkMemoryAllocateFlagsInfo flags{};
    flags.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_FLAGS_INFO;
    flags.pNext = place == Place::shared && device_->limits().exports_memory ? &exported : nullptr;
    flags.flags = VK_MEMORY_ALLOCATE_DEVICE_ADDRESS_BIT;
    VkMemoryAllocateInfo allocation{};
    allocation.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO;
    allocation.pNext = place == Place::host ? nullptr : &flags;
    allocation.allocationSize = needs.size;
    allocation.memoryTypeIndex =
        place == Place::host
            ? device_->memory_type(needs.memoryTypeBits,
                                   VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT,
                                   VK_MEMORY_PROPERTY_HOST_CACHED_BIT)
            : device_->memory_type(needs.memoryTypeBits, 0, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
    device_->check(vkAllocateMemory(device_->handle(), &allocation, nullptr, &memory_));
    allocation_ = needs.size;
}

void DeviceBuffer::destroy() {
    if (!device_ || is_forked()) return;
    vkDestroyBuffer(device_->handle(), buffer_, nullptr);
    vkFreeMemory(device_->handle(), memory_, nullptr);
}

void DeviceBuffer::swap(DeviceBuffer& other) noexcept {
    std::swap(device_, other.device_);
    std::swap(buffer_, other.buffer_);
    std::swap(memory_, other.memory_);
    std::swap(bytes_, other.bytes_);
    std::swap(allocation_, other.allocation_);
    std::swap(id_, other.id_);
    std::swap(address_, other.address_);
    std::swap(mapped_, other.mapped_);
}

int DeviceBuffer::export_fd() const {
    if (!device_->limits().exports_memory)
        throw DeviceError(device_->name() +
                          ": other programs cannot import the device's memory; download the mesh");
    VkMemoryGetFdInfoKHR info{};
    info.sType = VK_STRUCTURE_TYPE_MEMORY_GET_FD_INFO_KHR;
    info.memory = memory_;
    info.handleType = kFd;
    int fd = -1;
    device_->check(vkGetMemoryFdKHR(device_->handle(), &info, &fd));
    return fd;
}

}  // namespace marrow::gpu::internal
