// Puts itself between the library and Vulkan.
#include "gpu/kernel_times.h"

namespace marrow::bench {

using namespace gpu::internal;

namespace {

constexpr std::uint32_t kMostDispatches = 200;

KernelTimes* timing = nullptr;
PFN_vkCmdBindPipeline original_bind;
PFN_vkCmdDispatch original_dispatch;

}  // namespace

KernelTimes::KernelTimes(const std::shared_ptr<VulkanDevice>& device, const Specialization& constants)
    : clock_(device, 2 * kMostDispatches) {
    const std::pair<Kernel, const char*> kernels[] = {
        {Kernel::ranges, "ranges"}, {Kernel::select, "select"},      {Kernel::classify, "classify"},
        {Kernel::count, "count"},   {Kernel::reduce, "reduce"},      {Kernel::descend, "descend"},
        {Kernel::points, "points"}, {Kernel::triangles, "triangles"}};
    for (const auto& [kernel, name] : kernels) names_[device->pipeline(kernel, constants)] = name;
    timing = this;
    original_bind = vkCmdBindPipeline;
    original_dispatch = vkCmdDispatch;
    vkCmdBindPipeline = &bind;
    vkCmdDispatch = &dispatch;
}

KernelTimes::~KernelTimes() {
    vkCmdBindPipeline = original_bind;
    vkCmdDispatch = original_dispatch;
}

void KernelTimes::bind(VkCommandBuffer commands, VkPipelineBindPoint point, VkPipeline pipeline) {
    timing->bound_ = pipeline;
    original_bind(commands, point, pipeline);
}

void KernelTimes::dispatch(VkCommandBuffer commands, std::uint32_t x, std::uint32_t y, std::uint32_t z) {
    const auto number = static_cast<std::uint32_t>(timing->dispatched_.size());
    if (number == 0) timing->clock_.reset(commands);
    timing->clock_.stamp(commands, 2 * number);
    original_dispatch(commands, x, y, z);
    timing->clock_.stamp(commands, 2 * number + 1);
    timing->dispatched_.push_back(timing->bound_);
}

std::map<std::string, double> KernelTimes::take() {
    std::map<std::string, double> milliseconds;
    for (std::uint32_t i = 0; i < dispatched_.size(); ++i)
        milliseconds[names_.at(dispatched_[i])] += 1000 * clock_.seconds(2 * i, 2 * i + 1);
    dispatched_.clear();
    return milliseconds;
}

}  // namespace marrow::bench
