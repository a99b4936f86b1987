/// A histogram pyramid on a device: reduced from its leaves to the apex, then turned into first outputs.
#pragma once

#include <cstdint>
#include <memory>

#include "device_buffer.h"
#include "parameters.h"

namespace marrow::gpu::internal {

class DevicePyramid {
  public:
    DevicePyramid() = default;
    /// \throw DeviceError too many leaves, or not enough memory
    DevicePyramid(const std::shared_ptr<VulkanDevice>& device, std::uint64_t leaves);

    const PyramidParameters& parameters() const { return parameters_; }
    /// Where the number of outputs is.
    VkBuffer nodes() const { return nodes_.handle(); }
    std::uint64_t apex_offset() const;
    std::uint64_t bytes() const { return leaves_.bytes() + nodes_.bytes(); }

  private:
    DeviceBuffer leaves_, nodes_;
    PyramidParameters parameters_;
};

}  // namespace marrow::gpu::internal
