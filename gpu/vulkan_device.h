/// A device of Vulkan with one queue, and the pipelines that were made for it.
#pragma once

#include <volk.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
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

/// What a device can do, and what is asked of it at once. The defaults are the least that Vulkan promises.
struct Limits {
    std::uint64_t allocation = std::uint64_t{1} << 30;  ///< bytes of one allocation, or buffer
    bool float_controls = false;                        ///< a shader can say how floats are rounded
    bool exports_memory = false;                        ///< as file descriptors
    // These are ours. Tests lower them.
    std::uint64_t elements = std::uint64_t{1} << 31;  ///< of an array: in shaders, an index has 31 bits
    std::uint32_t groups = 4096;  ///< work groups of a dispatch: they fill any device; Vulkan allows 65535
    std::uint64_t staging = std::uint64_t{64}
                            << 20;  ///< bytes that are copied between host and device at once
};

/// Whether this process was forked from one that had opened a device. The driver's threads are not in the
/// child, and what is on the device is the parent's, so the child must neither use nor destroy it.
bool is_forked();
/// \throw DeviceError if is_forked()
void check_not_forked();

class VulkanDevice {
  public:
    explicit VulkanDevice(VkPhysicalDevice physical);
    ~VulkanDevice();
    VulkanDevice(const VulkanDevice&) = delete;
    VulkanDevice& operator=(const VulkanDevice&) = delete;

    /// How buffers are used.
    static constexpr VkBufferUsageFlags kHostUsage =
        VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT;
    static constexpr VkBufferUsageFlags kDeviceUsage =
        kHostUsage | VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT;

    VkDevice handle() const { return device_; }
    const std::string& name() const { return name_; }
    /// Whether the device has failed for good.
    bool is_lost() const { return lost_; }
    const Limits& limits() const { return limits_; }
    /// Makes the device appear smaller, for tests.
    void set_limits(const Limits& limits) { limits_ = limits; }
    VkPipelineLayout layout() const { return layout_; }
    std::uint32_t queue_family() const { return family_; }
    /// Nanoseconds of a timestamp's unit, and the bits that timestamps have. No bits: the queue has none.
    double timestamp_period() const { return timestamp_period_; }
    std::uint64_t timestamp_bits() const { return timestamp_bits_; }

    /// The pipeline of a kernel, made when it is first asked for.
    VkPipeline pipeline(Kernel kernel, Specialization constants);
    /// A type of memory that has all properties `required` and, if there is one, also those `preferred`.
    std::uint32_t memory_type(std::uint32_t allowed, VkMemoryPropertyFlags required,
                              VkMemoryPropertyFlags preferred) const;
    /// Starts commands, which signal the fence when they end. Any thread may call it. \throw DeviceError
    void submit(VkCommandBuffer commands, VkFence fence);
    /// \throw DeviceError unless `result` is success. After VK_ERROR_DEVICE_LOST the device is lost
    void check(VkResult result);

  private:
    void look_up(VkPhysicalDevice physical);
    void create(VkPhysicalDevice physical);
    void destroy();
    VkPipeline create_pipeline(Kernel kernel, const Specialization& constants);

    VkDevice device_ = VK_NULL_HANDLE;
    VkQueue queue_ = VK_NULL_HANDLE;
    std::uint32_t family_ = 0;
    VkPipelineLayout layout_ = VK_NULL_HANDLE;
    double timestamp_period_ = 0;
    std::uint64_t timestamp_bits_ = 0;
    VkPhysicalDeviceMemoryProperties memory_{};
    Limits limits_{};
    std::string name_;
    std::atomic<bool> lost_ = false;
    std::mutex queue_mutex_, pipelines_mutex_;
    std::map<std::tuple<Kernel, std::int32_t, bool, bool>, VkPipeline> pipelines_;
};

/// The device of this index in devices(). It is shared, and kept until the program ends because making it and
/// its pipelines takes long; a lost one is replaced. \throw DeviceError there is none, Vulkan failed, or the
/// process is_forked()
std::shared_ptr<VulkanDevice> open_device(std::size_t index);

}  // namespace marrow::gpu::internal
