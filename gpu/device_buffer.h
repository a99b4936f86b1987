/// Memory on a device, and its way to the host and back.
#pragma once

#include <volk.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>

#include "parameters.h"
#include "vulkan_device.h"

namespace marrow::gpu::internal {

/// A buffer with memory of its own.
class DeviceBuffer {
  public:
    enum class Place { device, host };  ///< memory near the kernels, or memory that the host reads and writes

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
    Address address() const { return address_; }   ///< of memory on the device
    std::byte* mapped() const { return mapped_; }  ///< of memory of the host

  private:
    void allocate(Place place);
    void destroy();
    void swap(DeviceBuffer& other) noexcept;

    std::shared_ptr<VulkanDevice> device_;
    VkBuffer buffer_ = VK_NULL_HANDLE;
    VkDeviceMemory memory_ = VK_NULL_HANDLE;
    std::uint64_t bytes_ = 0;
    Address address_ = 0;
    std::byte* mapped_ = nullptr;
};

/// Copies between the host and buffers of one device, in pieces.
class Staging {
  public:
    explicit Staging(std::shared_ptr<VulkanDevice> device);

    /// Fills `to`, whose size is a multiple of `unit`: fill(k, memory) writes the k-th unit.
    void upload(const DeviceBuffer& to, std::uint64_t unit,
                const std::function<void(std::uint64_t, std::byte*)>& fill);
    /// Copies the first `bytes` of a buffer.
    void download(const DeviceBuffer& from, std::uint64_t bytes, void* to);

  private:
    std::shared_ptr<VulkanDevice> device_;
    DeviceBuffer memory_;

    void reserve(std::uint64_t bytes);
};

/// Makes what the commands before it wrote visible to those after it, and to the host.
void barrier(VkCommandBuffer commands);

}  // namespace marrow::gpu::internal
