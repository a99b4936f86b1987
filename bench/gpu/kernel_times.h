/// Times kernels one by one: a timestamp goes before and after each that is dispatched.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "gpu/device_clock.h"

namespace marrow::bench {

/// While it lives, all dispatches of this process, on one thread, are timed. They wait for each other, so
/// that all of them together take somewhat longer than otherwise.
class KernelTimes {
  public:
    KernelTimes(const std::shared_ptr<gpu::internal::VulkanDevice>& device,
                const gpu::internal::Specialization& constants);
    ~KernelTimes();
    KernelTimes(const KernelTimes&) = delete;
    KernelTimes& operator=(const KernelTimes&) = delete;

    /// The milliseconds of each kernel since the last call, after the commands have ended.
    std::map<std::string, double> take();

  private:
    static void VKAPI_CALL bind(VkCommandBuffer commands, VkPipelineBindPoint point, VkPipeline pipeline);
    static void VKAPI_CALL dispatch(VkCommandBuffer commands, std::uint32_t x, std::uint32_t y,
                                    std::uint32_t z);

    gpu::internal::DeviceClock clock_;
    std::map<VkPipeline, std::string> names_;
    VkPipeline bound_ = VK_NULL_HANDLE;
    std::vector<VkPipeline> dispatched_;
};

}  // namespace marrow::bench
