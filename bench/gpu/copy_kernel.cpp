// Copies a buffer by a kernel of its own.
#include "gpu/copy_kernel.h"

#include <cstdint>
#include <vector>

#include "gpu/commands.h"
#include "gpu/device_buffer.h"
#include "gpu/device_clock.h"
#include "timing.h"

namespace marrow::bench {

using namespace gpu::internal;

namespace {

constexpr std::uint32_t kModule[] =
#include "copy.inc"
    ;

VkPipeline make_pipeline(VulkanDevice& device) {
    VkShaderModuleCreateInfo module{};
    module.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO;
    module.codeSize = sizeof(kModule);
    module.pCode = kModule;
    VkShaderModule shader = VK_NULL_HANDLE;
    device.check(vkCreateShaderModule(device.handle(), &module, nullptr, &shader));
    VkComputePipelineCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO;
    info.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
    info.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
    info.stage.module = shader;
    info.stage.pName = "main";
    info.layout = device.layout();
    VkPipeline pipeline = VK_NULL_HANDLE;
    const VkResult result =
        vkCreateComputePipelines(device.handle(), VK_NULL_HANDLE, 1, &info, nullptr, &pipeline);
    vkDestroyShaderModule(device.handle(), shader, nullptr);
    device.check(result);
    return pipeline;
}

}  // namespace

double copy_bandwidth(const std::shared_ptr<VulkanDevice>& device, bool software) {
    // Larger than the caches of GPUs. 65535 groups of 256 invocations copy 256 MiB, less 4 KiB.
    const std::uint32_t groups = software ? 4096 : 65535;
    const std::uint64_t bytes = std::uint64_t{groups} * 256 * 16;
    const DeviceBuffer from(device, bytes), to(device, bytes);
    struct {
        Address from, to;
    } const push{from.address(), to.address()};
    static_assert(sizeof(push) == sizeof(Push));
    const DeviceClock clock(device, 2);
    const VkPipeline pipeline = make_pipeline(*device);
    std::vector<double> seconds;
    for (int round = 0; round < 12; ++round) {
        Commands(device).run([&](VkCommandBuffer commands) {
            clock.reset(commands);
            vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline);
            vkCmdPushConstants(commands, device->layout(), VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof(push),
                               &push);
            clock.stamp(commands, 0);
            vkCmdDispatch(commands, groups, 1, 1);
            clock.stamp(commands, 1);
        });
        if (round > 0) seconds.push_back(clock.seconds(0, 1));  // the first touches the pages
    }
    vkDestroyPipeline(device->handle(), pipeline, nullptr);
    const double typical = median(seconds);
    return typical > 0 ? static_cast<double>(2 * bytes) / typical : 0;
}

}  // namespace marrow::bench
