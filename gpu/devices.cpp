// Lists the devices.
#include <marrow/gpu.h>

#include <algorithm>

#include "vulkan_device.h"

namespace marrow::gpu {

std::vector<Device> devices() {
    std::vector<Device> result;
    for (VkPhysicalDevice physical : internal::usable_devices()) {
        VkPhysicalDeviceProperties properties;
        vkGetPhysicalDeviceProperties(physical, &properties);
        VkPhysicalDeviceMemoryProperties memory;
        vkGetPhysicalDeviceMemoryProperties(physical, &memory);
        Device device{properties.deviceName, properties.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU, 0};
        for (std::uint32_t h = 0; h < memory.memoryHeapCount; ++h)
            device.memory = std::max<std::uint64_t>(device.memory, memory.memoryHeaps[h].size);
        result.push_back(std::move(device));
    }
    return result;
}

}  // namespace marrow::gpu
