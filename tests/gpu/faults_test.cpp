// Every call of Vulkan that can fail does so in its turn. The validation layer reports what is left behind
// when a device is destroyed, so the tests end with a new device.
#include <marrow/gpu.h>

#include <unistd.h>

#include <functional>
#include <memory>
#include <type_traits>

#include "gpu/compare.h"

namespace marrow::test {
namespace {

// While this lives, call number n of a function of Vulkan, counted from 0, and those after it, if `times` is
// more than 1, do nothing and fail. A device must have been opened before, because that loads the functions.
template <auto* Function>
class FailingCall;

template <class... Arguments, VkResult(VKAPI_PTR** Function)(Arguments...)>
class FailingCall<Function> {
  public:
    FailingCall(int n, VkResult error, int times = 1) {
        original_ = *Function;
        left_ = n;
        times_ = times;
        error_ = error;
        *Function = &call;
    }
    ~FailingCall() { *Function = original_; }
    FailingCall(const FailingCall&) = delete;
    FailingCall& operator=(const FailingCall&) = delete;

    bool failed() const { return left_ < 0; }

  private:
    static VkResult VKAPI_CALL call(Arguments... arguments) {
        const int left = left_--;
        if (left > 0 || left <= -times_) return original_(arguments...);
        if constexpr (std::is_same_v<decltype(original_), PFN_vkWaitForFences>) {
            // A lost device runs nothing any more.
            while (error_ == VK_ERROR_DEVICE_LOST && original_(arguments...) == VK_TIMEOUT) {
            }
        }
        return error_;
    }

    static inline VkResult (*original_)(Arguments...);
    static inline int left_, times_;
    static inline VkResult error_;
};

const Volume& small_scan() {
    static const Volume volume = [] {
        Random random(17);
        return scan<std::uint8_t>(grid(35, 12, 9), random);
    }();
    return volume;
}

const IsosurfaceOptions kPointsOnly{.normals = false};  // compiles faster

void replace_device() {
    EXPECT_THROW(gpu::internal::open_device(0)->check(VK_ERROR_DEVICE_LOST), gpu::DeviceError);
    gpu::internal::open_device(0);
}

// All that an extractor does; the second surface is larger.
void use(gpu::Extractor& extractor) {
    extractor.extract(110);
    const gpu::DeviceMesh& mesh = extractor.extract_on_device(60);
    const int fd = mesh.positions.export_fd();
    close(fd);
}

void expect_works(gpu::Extractor& extractor) {
    EXPECT_GT(compare(extractor, small_scan(), 60, kPointsOnly), 100u);
    EXPECT_GT(compare(extractor, small_scan(), 110, kPointsOnly), 10u);
}

// Fails each call in its turn: those that making an extractor takes, and those that using one takes.
template <auto* Function>
void fail_every_call(VkResult error, int times = 1) {
    const bool lost = error == VK_ERROR_DEVICE_LOST;
    int failures = 0;
    gpu::internal::open_device(0);
    for (const bool while_made : {true, false}) {
        int n = 0;
        for (bool failed = true; failed; ++n) {
            SCOPED_TRACE(testing::Message() << "call " << n << (while_made ? " of making" : " of using"));
            ASSERT_LT(n, 100);
            std::unique_ptr<gpu::Extractor> extractor;
            if (!while_made) extractor = std::make_unique<gpu::Extractor>(small_scan(), kPointsOnly);
            bool thrown = false;
            {
                const FailingCall<Function> fault(n, error, times);
                try {
                    if (while_made) extractor = std::make_unique<gpu::Extractor>(small_scan(), kPointsOnly);
                    if (!while_made) use(*extractor);
                } catch (const gpu::DeviceError&) {
                    thrown = true;
                }
                failed = fault.failed();
            }
            EXPECT_EQ(thrown, failed);
            failures += failed;
            if (extractor && lost && failed) {
                EXPECT_THROW(extractor->extract(60), gpu::DeviceError);
                EXPECT_THROW(extractor->extract_on_device(60), gpu::DeviceError);
            } else if (extractor) {
                expect_works(*extractor);
            }
        }
        gpu::Extractor next(small_scan(), kPointsOnly);
        expect_works(next);
    }
    EXPECT_GT(failures, 0) << "the function is not called";
    replace_device();
}

TEST(GpuFaults, AfterOutOfMemoryTheExtractorWorks) {
    // Twice, because memory for output is asked for again without its reserve.
    fail_every_call<&vkAllocateMemory>(VK_ERROR_OUT_OF_DEVICE_MEMORY, 2);
    fail_every_call<&vkCreateBuffer>(VK_ERROR_OUT_OF_HOST_MEMORY, 2);
    fail_every_call<&vkBindBufferMemory>(VK_ERROR_OUT_OF_DEVICE_MEMORY, 2);
    fail_every_call<&vkMapMemory>(VK_ERROR_OUT_OF_HOST_MEMORY);
    fail_every_call<&vkBeginCommandBuffer>(VK_ERROR_OUT_OF_HOST_MEMORY);
    fail_every_call<&vkEndCommandBuffer>(VK_ERROR_OUT_OF_DEVICE_MEMORY);
    fail_every_call<&vkQueueSubmit>(VK_ERROR_OUT_OF_DEVICE_MEMORY);
    fail_every_call<&vkWaitForFences>(VK_ERROR_OUT_OF_HOST_MEMORY);
    fail_every_call<&vkGetMemoryFdKHR>(VK_ERROR_TOO_MANY_OBJECTS);
}

TEST(GpuFaults, OutputNeedsNoReserve) {
    gpu::Extractor extractor(small_scan(), kPointsOnly);
    for (const double isovalue : {110, 60}) {  // the second surface is larger
        const FailingCall<&vkAllocateMemory> fault(0, VK_ERROR_OUT_OF_DEVICE_MEMORY);
        EXPECT_GT(compare(extractor, small_scan(), isovalue, kPointsOnly), 10u);
        EXPECT_TRUE(fault.failed());
    }
}

TEST(GpuFaults, AfterTheDeviceIsLostANewExtractorWorks) {
    fail_every_call<&vkQueueSubmit>(VK_ERROR_DEVICE_LOST);
    fail_every_call<&vkWaitForFences>(VK_ERROR_DEVICE_LOST);
}

TEST(GpuFaults, WhileTheDeviceWorksProgressIsReportedAndCanCancel) {
    int at_start = 0;
    bool cancel = false;
    const IsosurfaceOptions options{.normals = false, .progress = [&](double fraction) {
                                        at_start += fraction == 0;
                                        return !cancel || at_start < 3;
                                    }};
    gpu::Extractor extractor(small_scan(), options);
    at_start = 0;
    {
        const FailingCall<&vkWaitForFences> slow(0, VK_TIMEOUT, 4);
        EXPECT_GT(compare(extractor, small_scan(), 60, kPointsOnly), 100u);
    }
    EXPECT_GE(at_start, 5);  // once before the device works, and at least once for each wait
    cancel = true;
    at_start = 0;
    {
        const FailingCall<&vkWaitForFences> slow(0, VK_TIMEOUT, 4);
        EXPECT_THROW(extractor.extract(110), Cancelled);
    }
    cancel = false;
    expect_works(extractor);
}

// Fails each call in its turn that a device takes before it has extracted its first surface.
template <auto* Function>
void fail_every_first_call() {
    int n = 0;
    for (bool failed = true; failed; ++n) {
        SCOPED_TRACE(testing::Message() << "call " << n);
        ASSERT_LT(n, 100);
        EXPECT_THROW(gpu::internal::open_device(0)->check(VK_ERROR_DEVICE_LOST), gpu::DeviceError);
        bool thrown = false;
        {
            const FailingCall<Function> fault(n, VK_ERROR_OUT_OF_HOST_MEMORY);
            try {
                gpu::Extractor extractor(small_scan(), kPointsOnly);
                use(extractor);
            } catch (const gpu::DeviceError&) {
                thrown = true;
            }
            failed = fault.failed();
        }
        EXPECT_EQ(thrown, failed);
    }
    EXPECT_GT(n, 1) << "the function is not called";
    gpu::Extractor next(small_scan(), kPointsOnly);
    expect_works(next);
    replace_device();
}

TEST(GpuFaults, ADeviceThatCannotBeMadeIsTriedAgain) {
    fail_every_first_call<&vkCreateDevice>();
    fail_every_first_call<&vkCreatePipelineLayout>();
    fail_every_first_call<&vkCreateCommandPool>();
    fail_every_first_call<&vkAllocateCommandBuffers>();
    fail_every_first_call<&vkCreateFence>();
    fail_every_first_call<&vkCreateQueryPool>();
    fail_every_first_call<&vkCreateShaderModule>();
    fail_every_first_call<&vkCreateComputePipelines>();
}

}  // namespace
}  // namespace marrow::test
