// Lists the devices.
#include <marrow/gpu.h>

#include <algorithm>

#include "vulkan_device.h"

namespace marrow::gpu {

namespace {

DeviceKind kind_of(VkPhysicalDeviceType type) {
    switch (type) {
        case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
            return DeviceKind::discrete;
        case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
            return DeviceKind::integrated;
        case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
            return DeviceKind::virtual_gpu;
        case VK_PHYSICAL_DEVICE_TYPE_CPU:
            return DeviceKind::software;
        default:
            return DeviceKind::other;
    }
}

// What devices of Vulkan 1.1 need not say.
void add_identity(VkPhysicalDevice physical, Device& device) {
    VkPhysicalDeviceIDProperties ids{};
    ids.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ID_PROPERTIES;
    VkPhysicalDeviceDriverProperties driver{};
    driver.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DRIVER_PROPERTIES;
    driver.pNext = &ids;
    VkPhysicalDeviceProperties2 properties{};
    properties.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2;
    properties.pNext = &driver;
    vkGetPhysicalDeviceProperties2(physical, &properties);
    const std::string name = driver.driverName, info = driver.driverInfo;
    device.driver = info.empty() ? name : name + ' ' + info;
    std::copy_n(ids.deviceUUID, VK_UUID_SIZE, device.uuid.begin());
    std::copy_n(ids.driverUUID, VK_UUID_SIZE, device.driver_uuid.begin());
}

Device describe(VkPhysicalDevice physical) {
    VkPhysicalDeviceProperties properties;
    vkGetPhysicalDeviceProperties(physical, &properties);
    VkPhysicalDeviceMemoryProperties memory;
    vkGetPhysicalDeviceMemoryProperties(physical, &memory);
    Device device{.name = properties.deviceName, .kind = kind_of(properties.deviceType)};
    if (properties.apiVersion >= VK_API_VERSION_1_2) add_identity(physical, device);
    for (std::uint32_t h = 0; h < memory.memoryHeapCount; ++h) {
        const VkMemoryHeap& heap = memory.memoryHeaps[h];
        // Graphics cards also list memory of the host, which can be larger than their own.
        if ((heap.flags & VK_MEMORY_HEAP_DEVICE_LOCAL_BIT) != 0)
            device.memory = std::max<std::uint64_t>(device.memory, heap.size);
    }
    return device;
}

}  // namespace

std::vector<Device> devices() {
    std::vector<Device> result;
    for (VkPhysicalDevice physical : internal::usable_devices()) result.push_back(describe(physical));
    return result;
}

std::vector<UnusableDevice> unusable_devices() {
    std::vector<UnusableDevice> result;
    for (VkPhysicalDevice physical : internal::physical_devices()) {
        if (const char* reason = internal::why_unusable(physical))
            result.push_back({describe(physical), reason});
    }
    return result;
}

std::string why_no_devices() {
    const char* missing = internal::what_is_missing();
    return missing != nullptr ? missing : "the Vulkan drivers find no device";
}

}  // namespace marrow::gpu
