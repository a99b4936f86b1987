/// The samples of a volume on a device.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <marrow/progress.h>
#include <marrow/volume.h>

#include "device_buffer.h"
#include "parameters.h"
#include "staging.h"

namespace marrow::gpu::internal {

/// The volume's samples, in as many allocations as they need, each of whole slices. Rows are padded to words
/// of inside bits. One sample beyond the view is kept where the view has one, for normals.
class ResidentVolume {
  public:
    /// Copies the samples. \throw DeviceError not enough memory; Cancelled
    ResidentVolume(const std::shared_ptr<VulkanDevice>& device, Staging& staging, const VolumeView& volume,
                   const Progress& progress);

    /// Sets the parameters that say where the samples are.
    void describe(Parameters& parameters) const;
    /// Words of inside bits, one bit a sample.
    std::uint64_t bit_words() const;
    /// Blocks of samples, of which the kernels know the range.
    std::uint64_t blocks() const;
    /// Pieces of 16 bytes in all blocks, of which an invocation loads one.
    std::uint64_t loads() const;

  private:
    std::vector<DeviceBuffer> slabs_;
    DeviceBuffer addresses_;  // of the slabs
    std::array<std::int32_t, 3> dims_, stored_, lead_;
    std::uint32_t row_words_, slab_slices_, row_loads_;
    std::int32_t first_x_;
};

}  // namespace marrow::gpu::internal
