// Makes the instance, devices and pipelines of Vulkan.
#include "vulkan_device.h"

#include <unistd.h>

#include <algorithm>
#include <cstring>

#include <marrow/gpu.h>

#include "parameters.h"

namespace marrow::gpu::internal {

namespace {

// Vulkan's instance, or what is missing.
struct Instance {
    VkInstance handle = VK_NULL_HANDLE;
    const char* missing = nullptr;
};

Instance create_instance() {
    if (volkInitialize() != VK_SUCCESS)
        return {.missing = "the Vulkan loader, libvulkan.so.1, is not installed"};
    VkApplicationInfo application{};
    application.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO;
    application.pApplicationName = "marrow";
    application.apiVersion = VK_API_VERSION_1_2;
    VkInstanceCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO;
    info.pApplicationInfo = &application;
    VkInstance instance = VK_NULL_HANDLE;
    if (vkCreateInstance(&info, nullptr, &instance) != VK_SUCCESS)
        return {.missing = "no Vulkan driver is installed"};
    volkLoadInstance(instance);
    return {.handle = instance};
}

// It is never destroyed, because a driver may already be unloaded when static objects end.
const Instance& the_instance() {
    static const Instance instance = create_instance();
    return instance;
}

constexpr std::uint32_t kNoFamily = ~std::uint32_t{0};

std::vector<VkQueueFamilyProperties> queue_families(VkPhysicalDevice physical) {
    std::uint32_t count = 0;
    vkGetPhysicalDeviceQueueFamilyProperties(physical, &count, nullptr);
    std::vector<VkQueueFamilyProperties> families(count);
    vkGetPhysicalDeviceQueueFamilyProperties(physical, &count, families.data());
    return families;
}

// The family of queues for the kernels; one that does not also draw is preferred,
// as it disturbs the desktop less.
std::uint32_t compute_family(VkPhysicalDevice physical) {
    const std::vector<VkQueueFamilyProperties> families = queue_families(physical);
    std::uint32_t found = kNoFamily;
    for (std::uint32_t f = 0; f < families.size(); ++f) {
        if ((families[f].queueFlags & VK_QUEUE_COMPUTE_BIT) == 0) continue;
        if ((families[f].queueFlags & VK_QUEUE_GRAPHICS_BIT) == 0) return f;
        if (found == kNoFamily) found = f;
    }
    return found;
}

std::uint64_t valid_timestamp_bits(VkPhysicalDevice physical, std::uint32_t family) {
    const std::uint32_t bits = queue_families(physical)[family].timestampValidBits;
    return bits == 0 ? 0 : ~std::uint64_t{0} >> (64 - bits);
}

// Whether buffers of the kernels can be exported as file descriptors, without an
// allocation that is dedicated to them.
bool can_export_memory(VkPhysicalDevice physical) {
    std::uint32_t count = 0;
    if (vkEnumerateDeviceExtensionProperties(physical, nullptr, &count, nullptr) != VK_SUCCESS) return false;
    std::vector<VkExtensionProperties> extensions(count);
    if (vkEnumerateDeviceExtensionProperties(physical, nullptr, &count, extensions.data()) != VK_SUCCESS)
        return false;
    const bool offered = std::any_of(extensions.begin(), extensions.end(), [](const auto& extension) {
        return std::strcmp(extension.extensionName, VK_KHR_EXTERNAL_MEMORY_FD_EXTENSION_NAME) == 0;
    });
    if (!offered) return false;
    VkPhysicalDeviceExternalBufferInfo info{};
    info.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_EXTERNAL_BUFFER_INFO;
    info.usage = VulkanDevice::kDeviceUsage;
    info.handleType = VK_EXTERNAL_MEMORY_HANDLE_TYPE_OPAQUE_FD_BIT;
    VkExternalBufferProperties properties{};
    properties.sType = VK_STRUCTURE_TYPE_EXTERNAL_BUFFER_PROPERTIES;
    vkGetPhysicalDeviceExternalBufferProperties(physical, &info, &properties);
    const auto features = properties.externalMemoryProperties.externalMemoryFeatures;
    return (features & VK_EXTERNAL_MEMORY_FEATURE_EXPORTABLE_BIT) != 0 &&
           (features & VK_EXTERNAL_MEMORY_FEATURE_DEDICATED_ONLY_BIT) == 0;
}

}  // namespace

std::vector<VkPhysicalDevice> physical_devices() {
    const VkInstance instance = the_instance().handle;
    if (instance == VK_NULL_HANDLE) return {};
    std::uint32_t count = 0;
    if (vkEnumeratePhysicalDevices(instance, &count, nullptr) != VK_SUCCESS) return {};
    std::vector<VkPhysicalDevice> found(count);
    if (vkEnumeratePhysicalDevices(instance, &count, found.data()) != VK_SUCCESS) return {};
    return found;
}

std::vector<VkPhysicalDevice> usable_devices() {
    std::vector<VkPhysicalDevice> found = physical_devices();
    std::erase_if(found, [](VkPhysicalDevice physical) { return why_unusable(physical) != nullptr; });
    return found;
}

const char* why_unusable(VkPhysicalDevice physical) {
    VkPhysicalDeviceProperties properties;
    vkGetPhysicalDeviceProperties(physical, &properties);
    if (properties.apiVersion < VK_API_VERSION_1_2) return "it has no Vulkan 1.2";
    VkPhysicalDeviceVulkan12Features features{};
    features.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES;
    VkPhysicalDeviceFeatures2 all{};
    all.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2;
    all.pNext = &features;
    vkGetPhysicalDeviceFeatures2(physical, &all);
    if (features.bufferDeviceAddress != VK_TRUE) return "it has no addresses of buffers";
    if (properties.limits.maxComputeWorkGroupInvocations < 256)
        return "its work groups have fewer than 256 invocations";
    if (compute_family(physical) == kNoFamily) return "it has no queue for compute";
    return nullptr;
}

const char* what_is_missing() {
    return the_instance().missing;
}

bool is_forked() {
    static const pid_t owner = getpid();  // the first call is that of the first open_device()
    return getpid() != owner;
}

void check_not_forked() {
    if (is_forked()) throw DeviceError("devices do not survive a fork; use the CPU");
}

VulkanDevice::VulkanDevice(VkPhysicalDevice physical) {
    try {
        create(physical);
    } catch (...) {
        destroy();
        throw;
    }
}

VulkanDevice::~VulkanDevice() {
    destroy();
}

void VulkanDevice::look_up(VkPhysicalDevice physical) {
    VkPhysicalDeviceFloatControlsProperties floats{};
    floats.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FLOAT_CONTROLS_PROPERTIES;
    VkPhysicalDeviceMaintenance3Properties memory{};
    memory.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MAINTENANCE_3_PROPERTIES;
    memory.pNext = &floats;
    VkPhysicalDeviceProperties2 properties{};
    properties.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2;
    properties.pNext = &memory;
    vkGetPhysicalDeviceProperties2(physical, &properties);
    name_ = properties.properties.deviceName;
    // What an allocation is rounded up to must fit as well.
    constexpr std::uint64_t kPage = 65536;
    limits_.allocation = memory.maxMemoryAllocationSize / kPage * kPage;
    // Unless modes are independent, those of all widths would have to be the same.
    limits_.float_controls = floats.shaderRoundingModeRTEFloat32 == VK_TRUE &&
                             floats.shaderSignedZeroInfNanPreserveFloat32 == VK_TRUE &&
                             floats.roundingModeIndependence != VK_SHADER_FLOAT_CONTROLS_INDEPENDENCE_NONE;
    limits_.exports_memory = can_export_memory(physical);
    vkGetPhysicalDeviceMemoryProperties(physical, &memory_);
    family_ = compute_family(physical);
    timestamp_period_ = static_cast<double>(properties.properties.limits.timestampPeriod);
    timestamp_bits_ = valid_timestamp_bits(physical, family_);
}

void VulkanDevice::create(VkPhysicalDevice physical) {
    look_up(physical);
    const float priority = 1;
    VkDeviceQueueCreateInfo queue{};
    queue.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO;
    queue.queueFamilyIndex = family_;
    queue.queueCount = 1;
    queue.pQueuePriorities = &priority;
    VkPhysicalDeviceVulkan12Features features{};
    features.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES;
    features.bufferDeviceAddress = VK_TRUE;
    const char* const extensions[] = {VK_KHR_EXTERNAL_MEMORY_FD_EXTENSION_NAME};
    VkDeviceCreateInfo device{};
    device.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO;
    device.pNext = &features;
    device.queueCreateInfoCount = 1;
    device.pQueueCreateInfos = &queue;
    device.enabledExtensionCount = limits_.exports_memory ? 1 : 0;
    device.ppEnabledExtensionNames = extensions;
    check(vkCreateDevice(physical, &device, nullptr, &device_));
    vkGetDeviceQueue(device_, family_, 0, &queue_);

    VkPushConstantRange push{};
    push.stageFlags = VK_SHADER_STAGE_COMPUTE_BIT;
    push.size = sizeof(Push);
    VkPipelineLayoutCreateInfo layout{};
    layout.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO;
    layout.pushConstantRangeCount = 1;
    layout.pPushConstantRanges = &push;
    check(vkCreatePipelineLayout(device_, &layout, nullptr, &layout_));
}

void VulkanDevice::destroy() {
    if (device_ == VK_NULL_HANDLE || is_forked()) return;
    for (const auto& [key, pipeline] : pipelines_) vkDestroyPipeline(device_, pipeline, nullptr);
    vkDestroyPipelineLayout(device_, layout_, nullptr);
    vkDestroyDevice(device_, nullptr);
}

void VulkanDevice::check(VkResult result) {
    if (result == VK_SUCCESS) return;
    const std::string device = name_ + ": ";
    if (result == VK_ERROR_OUT_OF_DEVICE_MEMORY || result == VK_ERROR_OUT_OF_HOST_MEMORY)
        throw DeviceError(device +
                          "there is not enough memory on the device; crop the volume or use the CPU");
    if (result == VK_ERROR_DEVICE_LOST) {
        lost_ = true;
        throw DeviceError(device + "the device was lost; try again or use the CPU");
    }
    throw DeviceError(device + "Vulkan reports error " + std::to_string(result) + "; use the CPU");
}

std::uint32_t VulkanDevice::memory_type(std::uint32_t allowed, VkMemoryPropertyFlags required,
                                        VkMemoryPropertyFlags preferred) const {
    for (const VkMemoryPropertyFlags wanted : {required | preferred, required}) {
        for (std::uint32_t t = 0; t < memory_.memoryTypeCount; ++t) {
            const bool has = (memory_.memoryTypes[t].propertyFlags & wanted) == wanted;
            if ((allowed >> t & 1) != 0 && has) return t;
        }
    }
    throw DeviceError(name_ + ": the device has no memory of the kind that is needed; use the CPU");
}

VkPipeline VulkanDevice::pipeline(Kernel kernel, Specialization constants) {
    if (kernel == Kernel::points && limits_.float_controls) kernel = Kernel::points_controlled;
    // Kernels that do not read a constant share a pipeline for all of its values.
    const bool points = kernel == Kernel::points || kernel == Kernel::points_controlled;
    if (!points && kernel != Kernel::ranges && kernel != Kernel::classify) constants.sample_type = 0;
    if (!points && kernel != Kernel::count && kernel != Kernel::triangles) constants.closed = VK_FALSE;
    if (!points) constants.normals = VK_FALSE;
    const std::lock_guard lock(pipelines_mutex_);
    VkPipeline& pipeline = pipelines_[{kernel, constants.sample_type, constants.closed == VK_TRUE,
                                       constants.normals == VK_TRUE}];
    if (pipeline == VK_NULL_HANDLE) pipeline = create_pipeline(kernel, constants);
    return pipeline;
}

VkPipeline VulkanDevice::create_pipeline(Kernel kernel, const Specialization& constants) {
    const auto words = spirv(kernel);
    VkShaderModuleCreateInfo module_info{};
    module_info.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO;
    module_info.codeSize = words.size_bytes();
    module_info.pCode = words.data();
    VkShaderModule shader = VK_NULL_HANDLE;
    check(vkCreateShaderModule(device_, &module_info, nullptr, &shader));

    static_assert(sizeof(Specialization) == 3 * sizeof(std::uint32_t));
    VkSpecializationMapEntry entries[3];
    for (std::uint32_t id = 0; id < 3; ++id) entries[id] = {id, 4 * id, 4};
    const VkSpecializationInfo specialization{3, entries, sizeof(constants), &constants};
    VkComputePipelineCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO;
    info.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
    info.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
    info.stage.module = shader;
    info.stage.pName = "main";
    info.stage.pSpecializationInfo = &specialization;
    info.layout = layout_;
    VkPipeline pipeline = VK_NULL_HANDLE;
    const VkResult result = vkCreateComputePipelines(device_, VK_NULL_HANDLE, 1, &info, nullptr, &pipeline);
    vkDestroyShaderModule(device_, shader, nullptr);
    check(result);
    return pipeline;
}

void VulkanDevice::submit(VkCommandBuffer commands, VkFence fence) {
    const std::lock_guard lock(queue_mutex_);
    if (lost_) check(VK_ERROR_DEVICE_LOST);
    VkSubmitInfo info{};
    info.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO;
    info.commandBufferCount = 1;
    info.pCommandBuffers = &commands;
    check(vkQueueSubmit(queue_, 1, &info, fence));
}

std::shared_ptr<VulkanDevice> open_device(std::size_t index) {
    check_not_forked();  // before the mutex, which another thread of the parent may have held
    static std::mutex mutex;
    static auto& open =
        *new std::map<std::size_t, std::shared_ptr<VulkanDevice>>;  // never destroyed, as the instance
    const std::lock_guard lock(mutex);
    const std::vector<VkPhysicalDevice> found = usable_devices();
    if (index >= found.size())
        throw DeviceError("there is no GPU number " + std::to_string(index) + " (" +
                          std::to_string(found.size()) + " found); use the CPU");
    std::shared_ptr<VulkanDevice>& device = open[index];
    if (!device || device->is_lost()) device = std::make_shared<VulkanDevice>(found[index]);
    return device;
}

}  // namespace marrow::gpu::internal
