// Lists the devices.
#include <marrow/gpu.h>

#include <algorithm>

#include "vulkan_device.h"

namespace marrow::gpu {

std::vector<Device> devices() {
    std::vector<Device> result;
    for (VkPhysicalDevice physical : internal::usable_devices()) {
        VkPhysicalDeviceIDProperties ids{};
        ids.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ID_PROPERTIES;
        VkPhysicalDeviceProperties2 all{};
        all.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2;
        all.pNext = &ids;
        vkGetPhysicalDeviceProperties2(physical, &all);
        const VkPhysicalDeviceProperties& properties = all.properties;
        VkPhysicalDeviceMemoryProperties memory;
        vkGetPhysicalDeviceMemoryProperties(physical, &memory);
        Device device;
        device.name = properties.deviceName;
        device.software = properties.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU;
        std::copy_n(ids.deviceUUID, VK_UUID_SIZE, device.uuid.begin());
        std::copy_n(ids.driverUUID, VK_UUID_SIZE, device.driver_uuid.begin());
        for (std::uint32_t h = 0; h < memory.memoryHeapCount; ++h)
            device.memory = std::max<std::uint64_t>(device.memory, memory.memoryHeaps[h].size);
        result.push_back(std::move(device));
    }
    return result;
}

}  // namespace marrow::gpu
