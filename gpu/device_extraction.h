/// A volume on a device, and its surfaces.
#pragma once

#include <cstdint>
#include <memory>

#include <marrow/isosurface.h>
#include <marrow/mesh.h>
#include <marrow/volume.h>

#include "commands.h"
#include "core/grid/index_to_physical.h"
#include "device_clock.h"
#include "device_pyramid.h"
#include "resident_volume.h"
#include "staging.h"

namespace marrow::gpu::internal {

/// What the kernels report to the host.
struct Report {
    Status status;
    std::uint32_t points = 0, triangles = 0;
};

class DeviceExtraction {
  public:
    /// Copies the volume to the device, and finds the range of its blocks. \throw as Extractor
    DeviceExtraction(std::shared_ptr<VulkanDevice> device, const VolumeView& volume,
                     const IsosurfaceOptions& options);

    /// Extracts a surface into the output buffers. With `release` they are released to those who import them;
    /// otherwise download() can copy them. \throw as Extractor
    Report extract(double isovalue, bool release);
    void download(const Report& totals, Mesh& mesh);

    /// The output, in memory that the next surfaces are written to as well, as long as they fit.
    const std::shared_ptr<const DeviceBuffer>& positions() const { return positions_; }
    const std::shared_ptr<const DeviceBuffer>& normals() const { return normals_; }
    const std::shared_ptr<const DeviceBuffer>& indices() const { return indices_; }

    const ResidentVolume& samples() const { return samples_; }
    /// How long passes of the last extraction took.
    double classify_seconds() const { return clock_.seconds(0, 1); }
    double count_seconds() const { return clock_.seconds(1, 2); }
    /// The memory on the device beside the samples and the output.
    std::uint64_t scratch_bytes() const;

  private:
    using Output = std::shared_ptr<const DeviceBuffer>;

    std::uint64_t rows() const;
    void upload_row_bases(const marrow::internal::IndexToPhysical& to_physical);
    void find_ranges();
    void dispatch(VkCommandBuffer commands, Kernel kernel, std::uint64_t elements, std::uint32_t which = 0,
                  std::uint32_t level = 0) const;
    void update_parameters(VkCommandBuffer commands);
    void classify(VkCommandBuffer commands) const;
    void count(VkCommandBuffer commands) const;
    void emit(VkCommandBuffer commands, bool release) const;
    void release_output(VkCommandBuffer commands) const;
    void copy_report(VkCommandBuffer commands) const;
    Report read_report() const;
    void check_size(const Report& totals) const;
    bool has_room(const Report& totals) const;
    void make_room(const Report& totals);

    const std::shared_ptr<VulkanDevice> device_;
    const IsosurfaceOptions options_;
    const SampleType type_;
    DeviceClock clock_;  // start, classified, counted
    Staging staging_;
    const ResidentVolume samples_;
    Parameters parameters_;
    DeviceBuffer parameter_block_, status_, report_memory_;
    DeviceBuffer ranges_, list_, bits_, row_bases_;
    DevicePyramid points_, triangles_;
    Output positions_, normals_, indices_;
    Commands commands_;  // last, so that a batch that still runs ends before its memory does
};

}  // namespace marrow::gpu::internal
