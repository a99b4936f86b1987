// Reads timestamps.
#include "device_clock.h"

#include <utility>

namespace marrow::gpu::internal {

DeviceClock::DeviceClock(std::shared_ptr<VulkanDevice> device, std::uint32_t stamps)
    : device_(std::move(device)), stamps_(stamps) {
    if (device_->timestamp_bits() == 0) return;
    VkQueryPoolCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO;
    info.queryType = VK_QUERY_TYPE_TIMESTAMP;
    info.queryCount = stamps;
    device_->check(vkCreateQueryPool(device_->handle(), &info, nullptr, &pool_));
}

DeviceClock::~DeviceClock() {
    if (!is_forked()) vkDestroyQueryPool(device_->handle(), pool_, nullptr);
}

void DeviceClock::reset(VkCommandBuffer commands) const {
    if (pool_ != VK_NULL_HANDLE) vkCmdResetQueryPool(commands, pool_, 0, stamps_);
}

void DeviceClock::stamp(VkCommandBuffer commands, std::uint32_t number) const {
    if (pool_ != VK_NULL_HANDLE)
        vkCmdWriteTimestamp(commands, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, pool_, number);
}

double DeviceClock::seconds(std::uint32_t from, std::uint32_t to) const {
    if (pool_ == VK_NULL_HANDLE) return 0;
    return 1e-9 * device_->timestamp_period() *
           static_cast<double>((read(to) - read(from)) & device_->timestamp_bits());
}

std::uint64_t DeviceClock::read(std::uint32_t number) const {
    std::uint64_t ticks = 0;
    device_->check(vkGetQueryPoolResults(device_->handle(), pool_, number, 1, sizeof(ticks), &ticks,
                                         sizeof(ticks), VK_QUERY_RESULT_64_BIT));
    return ticks;
}

}  // namespace marrow::gpu::internal
