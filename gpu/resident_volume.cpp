// Copies samples to the device.
#include "resident_volume.h"

#include <algorithm>
#include <cstring>
#include <string>

#include <marrow/gpu.h>

#include "base/parallel.h"

namespace marrow::gpu::internal {

namespace {

// The place of a byte in an allocation has 32 bits, although the indices of the shaders count words.
constexpr std::uint64_t kMostSlabBytes = std::uint64_t{1} << 32;
constexpr std::uint64_t kBlockRows = 8;  // as in shaders/blocks.glsl

}  // namespace

ResidentVolume::ResidentVolume(const std::shared_ptr<VulkanDevice>& device, Staging& staging,
                               const VolumeView& volume, const Progress& progress) {
    for (std::size_t a = 0; a < 3; ++a) {
        const std::int64_t lead = std::min<std::int64_t>(volume.below[a], 1);
        const std::int64_t trail = std::min<std::int64_t>(volume.above[a], 1);
        dims_[a] = static_cast<std::int32_t>(volume.geometry.dims[a]);  // check_volume() allows no more
        lead_[a] = static_cast<std::int32_t>(lead);
        stored_[a] = static_cast<std::int32_t>(lead + dims_[a] + trail);
    }
    first_x_ = static_cast<std::int32_t>(volume.first[0]);
    row_words_ = (static_cast<std::uint32_t>(stored_[0]) + 31) / 32;
    if (bit_words() >= device->limits().elements)
        throw DeviceError(device->name() + ": the volume has too many samples for the device; use the CPU");

    const std::uint64_t sample = sample_size(volume.type), row = 32 * sample * row_words_;
    row_loads_ = static_cast<std::uint32_t>(row / 16);
    const std::uint64_t slice = row * static_cast<std::uint64_t>(stored_[1]);
    const auto slices = static_cast<std::uint32_t>(stored_[2]);
    const std::uint64_t fit = std::min(device->limits().allocation, kMostSlabBytes) / slice;
    slab_slices_ = static_cast<std::uint32_t>(std::clamp<std::uint64_t>(fit, 1, slices));

    const auto* view = static_cast<const std::byte*>(volume.data);
    const std::int64_t row_pitch = volume.row_pitch(), slice_pitch = volume.slice_pitch();
    const std::uint64_t filled = static_cast<std::uint64_t>(stored_[0]) * sample;
    marrow::internal::Stage stage(progress, 0, 1, slices);
    for (std::uint32_t begin = 0; begin < slices; begin += slab_slices_) {
        const std::uint32_t end = std::min(begin + slab_slices_, slices);
        slabs_.emplace_back(device, (end - begin) * slice);
        staging.upload(slabs_.back(), row, [&](std::uint64_t r, std::byte* to) {
            const auto rows = static_cast<std::uint64_t>(stored_[1]);
            const std::int64_t y = static_cast<std::int64_t>(r % rows) - lead_[1];
            const std::int64_t z = begin + static_cast<std::int64_t>(r / rows) - lead_[2];
            const std::int64_t first = z * slice_pitch + y * row_pitch - lead_[0];
            std::memcpy(to, view + first * static_cast<std::int64_t>(sample), filled);
            std::memset(to + filled, 0, row - filled);
            if (r % rows + 1 == rows) stage.step();
        });
    }
    addresses_ = DeviceBuffer(device, slabs_.size() * sizeof(Address));
    staging.upload(addresses_, sizeof(Address), [&](std::uint64_t k, std::byte* to) {
        const Address address = slabs_[k].address();
        std::memcpy(to, &address, sizeof(address));
    });
}

std::uint64_t ResidentVolume::bit_words() const {
    return std::uint64_t{row_words_} * static_cast<std::uint64_t>(stored_[1]) *
           static_cast<std::uint64_t>(stored_[2]);
}

std::uint64_t ResidentVolume::blocks() const {
    const std::uint64_t rows = (static_cast<std::uint64_t>(stored_[1]) + kBlockRows - 1) / kBlockRows;
    return row_words_ * rows * static_cast<std::uint64_t>(stored_[2]);
}

std::uint64_t ResidentVolume::loads() const {
    return blocks() / row_words_ * kBlockRows * row_loads_;
}

void ResidentVolume::describe(Parameters& parameters) const {
    parameters.slabs = addresses_.address();
    parameters.dims = dims_;
    parameters.stored = stored_;
    parameters.lead = lead_;
    parameters.first_x = first_x_;
    parameters.row_words = row_words_;
    parameters.slab_slices = slab_slices_;
}

}  // namespace marrow::gpu::internal
