/// Batches of commands that run on a device.
#pragma once

#include <volk.h>

#include <functional>
#include <memory>

#include <marrow/progress.h>

#include "vulkan_device.h"

namespace marrow::gpu::internal {

/// Who accesses memory. Values can be combined.
enum Access : unsigned { kCopy = 1, kKernel = 2, kHost = 4 };

/// Makes what the commands before it wrote as `from` visible to those after it that access memory as `to`,
/// and lets these begin only then.
void barrier(VkCommandBuffer commands, unsigned from, unsigned to);

/// Runs batches of commands, one after the other.
class Commands {
  public:
    explicit Commands(std::shared_ptr<VulkanDevice> device);
    ~Commands();
    Commands(const Commands&) = delete;
    Commands& operator=(const Commands&) = delete;

    /// Records a batch and starts it, after the one before has ended. \throw DeviceError
    void start(const std::function<void(VkCommandBuffer)>& record);
    /// Waits for the end of the batch, if one was started, and reports `fraction` from time to time.
    /// \throw DeviceError; Cancelled: the batch still runs
    void wait(const Progress& progress = {}, double fraction = 0);
    /// The same where neither progress nor errors are of interest any more.
    void wait_until_idle() noexcept;
    /// start() and wait().
    void run(const std::function<void(VkCommandBuffer)>& record, const Progress& progress = {},
             double fraction = 0);

  private:
    void create();
    void destroy() noexcept;

    std::shared_ptr<VulkanDevice> device_;
    VkCommandPool pool_ = VK_NULL_HANDLE;
    VkCommandBuffer commands_ = VK_NULL_HANDLE;
    VkFence fence_ = VK_NULL_HANDLE;
    bool running_ = false;
};

}  // namespace marrow::gpu::internal
