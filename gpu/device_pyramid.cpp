// Lays out the levels of a histogram pyramid.
#include "device_pyramid.h"

#include <algorithm>

#include <marrow/gpu.h>

namespace marrow::gpu::internal {

DevicePyramid::DevicePyramid(const std::shared_ptr<VulkanDevice>& device, std::uint64_t leaves) {
    constexpr std::uint64_t kBranching = 16;  // as in the shaders
    // Leaves are bytes in words, but their number must fit in one as well.
    if (leaves >= std::min(4 * device->limits().elements, std::uint64_t{1} << 32))
        throw DeviceError(device->name() + ": the volume has too many rows for the device; use the CPU");
    parameters_.size[0] = static_cast<std::uint32_t>(leaves);
    std::uint64_t nodes = 0, size = leaves;
    do {
        size = (size + kBranching - 1) / kBranching;
        ++parameters_.top;
        parameters_.size[parameters_.top] = static_cast<std::uint32_t>(size);
        parameters_.begin[parameters_.top] = static_cast<std::uint32_t>(nodes);
        nodes += size;
    } while (size > 1);
    leaves_ = DeviceBuffer(device, kBranching * parameters_.size[1]);  // read 16 at a time
    nodes_ = DeviceBuffer(device, nodes * sizeof(std::uint32_t));
    parameters_.leaves = leaves_.address();
    parameters_.nodes = nodes_.address();
}

std::uint64_t DevicePyramid::apex_offset() const {
    return parameters_.begin[parameters_.top] * sizeof(std::uint32_t);
}

}  // namespace marrow::gpu::internal
