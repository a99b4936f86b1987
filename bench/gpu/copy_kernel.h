/// Measures how fast a kernel copies memory on a device.
#pragma once

#include <memory>

#include "gpu/vulkan_device.h"

namespace marrow::bench {

/// Bytes read and written in a second, the median of several rounds. 0: the device has no timestamps.
double copy_bandwidth(const std::shared_ptr<gpu::internal::VulkanDevice>& device, bool software);

}  // namespace marrow::bench
