/// Timestamps that a device writes between its commands.
#pragma once

#include <volk.h>

#include <cstdint>
#include <memory>

#include "vulkan_device.h"

namespace marrow::gpu::internal {

/// A fixed number of timestamps. On a device without them, no time passes.
class DeviceClock {
  public:
    DeviceClock(std::shared_ptr<VulkanDevice> device, std::uint32_t stamps);
    ~DeviceClock();
    DeviceClock(const DeviceClock&) = delete;
    DeviceClock& operator=(const DeviceClock&) = delete;

    /// Forgets all timestamps. It must come before the first in each batch of commands.
    void reset(VkCommandBuffer commands) const;
    /// Writes a timestamp when the kernels before it have ended.
    void stamp(VkCommandBuffer commands, std::uint32_t number) const;
    /// The time between two timestamps, after the commands have ended.
    double seconds(std::uint32_t from, std::uint32_t to) const;

  private:
    std::uint64_t read(std::uint32_t number) const;

    std::shared_ptr<VulkanDevice> device_;
    std::uint32_t stamps_;
    VkQueryPool pool_ = VK_NULL_HANDLE;
};

}  // namespace marrow::gpu::internal
