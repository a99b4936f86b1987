/// A device of Vulkan with one queue, and the pipelines that were made for it.
#pragma once

#include <volk.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <tuple>
#include <vector>

#include "kernels.h"

namespace marrow::gpu::internal {

/// All devices; none where Vulkan is not installed or fails.
std::vector<VkPhysicalDevice> physical_devices();

/// Those that can run the kernels.
std::vector<VkPhysicalDevice> usable_devices();

/// Why a device cannot run the kernels; null if it can.
const char* why_unusable(VkPhysicalDevice physical);

/// What of Vulkan is not installed; null if it is.
const char* what_is_missing();

/// What pipelines are made for: the specialization constants of shaders/parameters.glsl.
struct Specialization {
    std::int32_t sample_type;
    VkBool32 closed, normals;
};

/// What a device can do. The defaults are the least that Vulkan promises.
struct Limits {
    std::uint64_t allocation = std::uint64_t{1} << 30;  ///< bytes of one allocation
    std::uint32_t groups = 65535;                       ///< work groups of a dispatch along an axis
    bool float_controls = false;                        ///< a shader can say how floats are rounded
};

class VulkanDevice {
  public:
    explicit VulkanDevice(VkPhysicalDevice physical);
    ~VulkanDevice();
    VulkanDevice(const VulkanDevice&) = delete;
    VulkanDevice& operator=(const VulkanDevice&) = delete;

    VkDevice handle() const { return device_; }
    const std::string& name() const { return name_; }
    /// Whether the device has failed for good.
    bool is_lost() const { return lost_; }
    const Limits& limits() const { return limits_; }
    /// Makes the device appear smaller, for tests.
    void set_limits(const Limits& limits) { limits_ = limits; }
    VkPipelineLayout layout() const { return layout_; }

    /// The pipeline of a kernel, made when it is first asked for.
    VkPipeline pipeline(Kernel kernel, const Specialization& constants);
    /// A type of memory that has all properties `required` and, if there is one, also those `preferred`.
    std::uint32_t memory_type(std::uint32_t allowed, VkMemoryPropertyFlags required,
                              VkMemoryPropertyFlags preferred) const;
    /// Records commands, runs them, and waits for their end.
    void run(const std::function<void(VkCommandBuffer)>& record);
    /// \throw DeviceError unless `result` is success. After VK_ERROR_DEVICE_LOST the device is lost
    void check(VkResult result);

  private:
    void create(VkPhysicalDevice physical);
    void destroy();
    VkPipeline create_pipeline(Kernel kernel, const Specialization& constants);

    VkDevice device_ = VK_NULL_HANDLE;
    VkQueue queue_ = VK_NULL_HANDLE;
    VkCommandPool pool_ = VK_NULL_HANDLE;
    VkCommandBuffer commands_ = VK_NULL_HANDLE;
    VkFence fence_ = VK_NULL_HANDLE;
    VkPipelineLayout layout_ = VK_NULL_HANDLE;
    VkPhysicalDeviceMemoryProperties memory_{};
    Limits limits_{};
    std::string name_;
    std::atomic<bool> lost_ = false;
    std::mutex queue_mutex_, pipelines_mutex_;  // commands may ask for pipelines while they are recorded
    std::map<std::tuple<Kernel, std::int32_t, bool, bool>, VkPipeline> pipelines_;
};

/// The device of this index in devices(). It is shared, and kept until the program ends because making it and its
/// pipelines takes long; a lost one is replaced. \throw DeviceError there is none, or Vulkan failed
std::shared_ptr<VulkanDevice> open_device(std::size_t index);

}  // namespace marrow::gpu::internal
