// Records commands and waits for them.
#include "commands.h"

#include <cstdint>
#include <utility>

#include "base/progress.h"

namespace marrow::gpu::internal {

namespace {

constexpr std::uint64_t kForever = ~std::uint64_t{0};
constexpr std::uint64_t kBetweenReports = 50'000'000;  // nanoseconds

// `flags` if an access is one of a combination.
VkFlags if_has(unsigned accesses, Access access, VkFlags flags) {
    return (accesses & access) != 0 ? flags : 0;
}

VkPipelineStageFlags stages(unsigned accesses) {
    return if_has(accesses, kCopy, VK_PIPELINE_STAGE_TRANSFER_BIT) |
           if_has(accesses, kKernel, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT) |
           if_has(accesses, kHost, VK_PIPELINE_STAGE_HOST_BIT);
}

}  // namespace

void barrier(VkCommandBuffer commands, unsigned from, unsigned to) {
    VkMemoryBarrier memory{};
    memory.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER;
    memory.srcAccessMask =
        if_has(from, kCopy, VK_ACCESS_TRANSFER_WRITE_BIT) | if_has(from, kKernel, VK_ACCESS_SHADER_WRITE_BIT);
    memory.dstAccessMask = if_has(to, kCopy, VK_ACCESS_TRANSFER_READ_BIT | VK_ACCESS_TRANSFER_WRITE_BIT) |
                           if_has(to, kKernel, VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT) |
                           if_has(to, kHost, VK_ACCESS_HOST_READ_BIT);
    vkCmdPipelineBarrier(commands, stages(from), stages(to), 0, 1, &memory, 0, nullptr, 0, nullptr);
}

Commands::Commands(std::shared_ptr<VulkanDevice> device) : device_(std::move(device)) {
    try {
        create();
    } catch (...) {
        destroy();
        throw;
    }
}

Commands::~Commands() {
    if (is_forked()) return;
    wait_until_idle();
    destroy();
}

void Commands::create() {
    const VkDevice device = device_->handle();
    VkCommandPoolCreateInfo pool{};
    pool.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO;
    pool.flags = VK_COMMAND_POOL_CREATE_TRANSIENT_BIT;
    pool.queueFamilyIndex = device_->queue_family();
    device_->check(vkCreateCommandPool(device, &pool, nullptr, &pool_));
    VkCommandBufferAllocateInfo commands{};
    commands.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
    commands.commandPool = pool_;
    commands.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
    commands.commandBufferCount = 1;
    device_->check(vkAllocateCommandBuffers(device, &commands, &commands_));
    VkFenceCreateInfo fence{};
    fence.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO;
    device_->check(vkCreateFence(device, &fence, nullptr, &fence_));
}

void Commands::destroy() noexcept {
    vkDestroyFence(device_->handle(), fence_, nullptr);
    vkDestroyCommandPool(device_->handle(), pool_, nullptr);
}

void Commands::start(const std::function<void(VkCommandBuffer)>& record) {
    wait();
    device_->check(vkResetCommandPool(device_->handle(), pool_, 0));
    VkCommandBufferBeginInfo begin{};
    begin.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
    begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
    device_->check(vkBeginCommandBuffer(commands_, &begin));
    record(commands_);
    device_->check(vkEndCommandBuffer(commands_));
    device_->check(vkResetFences(device_->handle(), 1, &fence_));
    device_->submit(commands_, fence_);
    running_ = true;
}

void Commands::wait(const Progress& progress, double fraction) {
    check_not_forked();
    if (!running_) return;
    const auto wait_for = [&](std::uint64_t nanoseconds) {
        return vkWaitForFences(device_->handle(), 1, &fence_, VK_TRUE, nanoseconds);
    };
    VkResult result = wait_for(kBetweenReports);
    for (; result == VK_TIMEOUT; result = wait_for(kBetweenReports))
        marrow::internal::report_progress(progress, fraction);
    // A device that is lost ends everything. After other errors the batch still runs.
    running_ = result != VK_SUCCESS && result != VK_ERROR_DEVICE_LOST;
    device_->check(result);
}

void Commands::wait_until_idle() noexcept {
    if (running_) vkWaitForFences(device_->handle(), 1, &fence_, VK_TRUE, kForever);
    running_ = false;
}

void Commands::run(const std::function<void(VkCommandBuffer)>& record, const Progress& progress,
                   double fraction) {
    start(record);
    wait(progress, fraction);
}

}  // namespace marrow::gpu::internal
