/// Memory on a device.
#pragma once

#include <volk.h>

#include <cstddef>
#include <cstdint>
#include <memory>

#include "parameters.h"
#include "vulkan_device.h"

namespace marrow::gpu::internal {

/// A buffer with memory of its own.
class DeviceBuffer {
  public:
    enum class Place {
        device,  ///< near the kernels
        shared,  ///< the same; others can import it if the device lets them
        host     ///< where the host reads and writes
    };

    DeviceBuffer() = default;
    /// \throw DeviceError there is not enough memory, or one allocation cannot be so large
    DeviceBuffer(std::shared_ptr<VulkanDevice> device, std::uint64_t bytes, Place place = Place::device);
    ~DeviceBuffer();
    DeviceBuffer(DeviceBuffer&& other) noexcept { swap(other); }
    DeviceBuffer& operator=(DeviceBuffer&& other) noexcept {
        swap(other);
        return *this;
    }

    VkBuffer handle() const { return buffer_; }
    std::uint64_t bytes() const { return bytes_; }
    Address address() const { return address_; }              ///< of memory on the device
    std::byte* mapped() const { return mapped_; }             ///< of memory of the host
    std::uint64_t allocation() const { return allocation_; }  ///< bytes of the memory, at least bytes()
    std::uint64_t id() const { return id_; }                  ///< differs from that of all other buffers
    /// A new file descriptor of shared memory. \throw DeviceError
    int export_fd() const;

  private:
    void create(Place place);
    void allocate(const VkMemoryRequirements& needs, Place place);
    void destroy();
    void swap(DeviceBuffer& other) noexcept;

    std::shared_ptr<VulkanDevice> device_;
    VkBuffer buffer_ = VK_NULL_HANDLE;
    VkDeviceMemory memory_ = VK_NULL_HANDLE;
    std::uint64_t bytes_ = 0, allocation_ = 0, id_ = 0;
    Address address_ = 0;
    std::byte* mapped_ = nullptr;
};

}  // namespace marrow::gpu::internal
