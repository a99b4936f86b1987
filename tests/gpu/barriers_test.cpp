// Kernels see what the kernels before them wrote. Software devices run one kernel after the other in any
// case, and the validation layer does not follow addresses, so the commands themselves are looked at.
#include <marrow/gpu.h>

#include <map>
#include <utility>
#include <vector>

#include "gpu/compare.h"
#include "gpu/parameters.h"

namespace marrow::test {
namespace {

using gpu::internal::Kernel;

// A kernel, and whether it waits for the kernels before it and sees what they wrote.
struct Dispatch {
    Kernel kernel;
    std::uint32_t which, level;  // as pushed
    bool waits;
};

// While this lives, what is recorded for the device.
class Recorder {
  public:
    Recorder() : device_(gpu::internal::open_device(0)) {
        current = this;
        bind_ = std::exchange(vkCmdBindPipeline, &bind);
        push_ = std::exchange(vkCmdPushConstants, &push);
        dispatch_ = std::exchange(vkCmdDispatch, &dispatch);
        barrier_ = std::exchange(vkCmdPipelineBarrier, &barrier);
    }
    ~Recorder() {
        vkCmdBindPipeline = bind_;
        vkCmdPushConstants = push_;
        vkCmdDispatch = dispatch_;
        vkCmdPipelineBarrier = barrier_;
    }
    Recorder(const Recorder&) = delete;
    Recorder& operator=(const Recorder&) = delete;

    // In the order of their commands.
    std::vector<Dispatch> dispatches(const gpu::internal::Specialization& constants) const {
        std::map<VkPipeline, Kernel> kernels;
        for (const Kernel kernel : {Kernel::ranges, Kernel::select, Kernel::classify, Kernel::count,
                                    Kernel::reduce, Kernel::descend, Kernel::points, Kernel::triangles})
            kernels[device_->pipeline(kernel, constants)] = kernel;
        std::vector<Dispatch> result;
        for (const Recorded& r : recorded_)
            result.push_back({kernels.at(r.pipeline), r.push.which, r.push.level, r.waits});
        return result;
    }

  private:
    struct Recorded {
        VkPipeline pipeline = VK_NULL_HANDLE;
        gpu::internal::Push push{};
        bool waits = false;
    };

    static void VKAPI_CALL bind(VkCommandBuffer commands, VkPipelineBindPoint point, VkPipeline pipeline) {
        current->next_.pipeline = pipeline;
        current->bind_(commands, point, pipeline);
    }
    static void VKAPI_CALL push(VkCommandBuffer commands, VkPipelineLayout layout, VkShaderStageFlags stages,
                                std::uint32_t begin, std::uint32_t size, const void* values) {
        std::memcpy(&current->next_.push, values, sizeof(gpu::internal::Push));
        current->push_(commands, layout, stages, begin, size, values);
    }
    static void VKAPI_CALL dispatch(VkCommandBuffer commands, std::uint32_t x, std::uint32_t y,
                                    std::uint32_t z) {
        current->recorded_.push_back(current->next_);
        current->next_.waits = false;
        current->dispatch_(commands, x, y, z);
    }
    static void VKAPI_CALL barrier(VkCommandBuffer commands, VkPipelineStageFlags from,
                                   VkPipelineStageFlags to, VkDependencyFlags flags, std::uint32_t count,
                                   const VkMemoryBarrier* all, std::uint32_t buffer_count,
                                   const VkBufferMemoryBarrier* buffers, std::uint32_t image_count,
                                   const VkImageMemoryBarrier* images) {
        constexpr VkPipelineStageFlags kStage = VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT;
        constexpr VkAccessFlags kReadWrite = VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT;
        for (std::uint32_t i = 0; i < count && (from & kStage) != 0 && (to & kStage) != 0; ++i) {
            if ((all[i].srcAccessMask & VK_ACCESS_SHADER_WRITE_BIT) != 0 &&
                (all[i].dstAccessMask & kReadWrite) == kReadWrite)
                current->next_.waits = true;
        }
        current->barrier_(commands, from, to, flags, count, all, buffer_count, buffers, image_count, images);
    }

    static inline Recorder* current = nullptr;
    std::shared_ptr<gpu::internal::VulkanDevice> device_;
    std::vector<Recorded> recorded_;
    Recorded next_;
    PFN_vkCmdBindPipeline bind_;
    PFN_vkCmdPushConstants push_;
    PFN_vkCmdDispatch dispatch_;
    PFN_vkCmdPipelineBarrier barrier_;
};

// Whether neither kernel reads or writes what the other writes.
bool independent(const Dispatch& a, const Dispatch& b) {
    if (a.kernel == Kernel::points && b.kernel == Kernel::triangles) return true;
    const bool builds_pyramid = a.kernel == Kernel::reduce || a.kernel == Kernel::descend;
    return builds_pyramid && a.kernel == b.kernel && a.which != b.which;
}

TEST(GpuBarriers, KernelsWaitForThoseBeforeThem) {
    Random random(22);
    const Volume volume = scan<std::uint8_t>(grid(35, 12, 9), random);
    const Recorder recorder;
    gpu::Extractor extractor(volume);
    for (const double isovalue : {110, 60}) extractor.extract(isovalue);  // the second surface is larger
    const std::vector<Dispatch> dispatches =
        recorder.dispatches({static_cast<std::int32_t>(SampleType::uint8), VK_FALSE, VK_TRUE});
    std::map<Kernel, int> times;
    std::size_t last_wait = 0;  // the dispatch that waited last
    for (std::size_t i = 0; i < dispatches.size(); ++i) {
        ++times[dispatches[i].kernel];
        if (dispatches[i].waits) last_wait = i;
        for (std::size_t before = last_wait; before < i; ++before)
            EXPECT_TRUE(independent(dispatches[before], dispatches[i])) << "dispatch " << i;
    }
    EXPECT_EQ(times.size(), 8u);
    EXPECT_GE(times[Kernel::descend], 4);
    EXPECT_EQ(times[Kernel::triangles], 3);
}

}  // namespace
}  // namespace marrow::test
