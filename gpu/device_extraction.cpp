// The passes of the extraction on a device, in order: classify, count, emit.
#include "device_extraction.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstring>
#include <limits>
#include <new>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

#include <marrow/gpu.h>

#include "base/parallel.h"
#include "base/progress.h"
#include "base/resize_discarding.h"
#include "core/grid/threshold.h"
#include "core/marching_cubes/case_table.h"

namespace marrow::gpu::internal {

using namespace marrow::internal;

namespace {

// The least sample that is inside, as an integer in the order of the samples (see ordered() in
// shaders/samples.glsl). If no sample can be inside, no integer of a sample is as large.
std::int32_t ordered_threshold(SampleType type, double isovalue) {
    return visit_sample_type(type, [&](auto sample) {
        using T = decltype(sample);
        const std::optional<T> threshold = inside_threshold<T>(isovalue);
        if (!threshold) return std::numeric_limits<std::int32_t>::max();
        if constexpr (std::is_same_v<T, float>) {
            const float lowest = *threshold == 0 ? -0.0f : *threshold;  // both zeros are inside then
            const auto bits = std::bit_cast<std::int32_t>(lowest);
            return bits ^ (bits >> 31 & 0x7fffffff);
        } else {
            return static_cast<std::int32_t>(*threshold);
        }
    });
}

// The case table as the kernels read it: 15 edges of 4 bits, then the number of triangles.
std::array<std::array<std::uint32_t, 2>, 256> pack_cases(bool mirrored) {
    const std::array<Case, 256>& cases = mirrored ? kMirroredCases : kCases;
    std::array<std::array<std::uint32_t, 2>, 256> packed{};
    for (std::size_t c = 0; c < 256; ++c) {
        std::uint64_t bits = std::uint64_t{cases[c].triangles} << 60;
        for (std::size_t k = 0; k < 3 * kMaxTriangles; ++k) bits |= std::uint64_t{cases[c].edges[k]} << 4 * k;
        packed[c] = {static_cast<std::uint32_t>(bits), static_cast<std::uint32_t>(bits >> 32)};
    }
    return packed;
}

template <class T>
T* resize(Buffer<T>& buffer, std::size_t size) {
    try {
        resize_discarding(buffer, size);
    } catch (const std::bad_alloc&) {
        throw LimitError("there is not enough memory for the surface; crop or coarsen the volume");
    }
    return buffer.data();
}

// Makes room for output, and for a quarter more if that fits, so that the next isovalue need not.
void grow(const std::shared_ptr<VulkanDevice>& device, std::shared_ptr<const DeviceBuffer>& buffer,
          std::uint64_t bytes) {
    if (buffer && buffer->bytes() >= bytes) return;
    buffer.reset();
    const auto allocate = [&](std::uint64_t size) {
        buffer = std::make_shared<const DeviceBuffer>(device, size, DeviceBuffer::Place::shared);
    };
    const std::uint64_t more = std::min(bytes + bytes / 4, device->limits().allocation) / 4 * 4;
    try {
        allocate(std::max(bytes, more));
    } catch (const DeviceError&) {
        allocate(bytes);
    }
}

std::uint64_t bytes_of(const std::shared_ptr<const DeviceBuffer>& buffer) {
    return buffer ? buffer->bytes() : 0;
}

Address address_of(const std::shared_ptr<const DeviceBuffer>& buffer) {
    return buffer ? buffer->address() : 0;
}

}  // namespace

DeviceExtraction::DeviceExtraction(std::shared_ptr<VulkanDevice> device, const VolumeView& volume,
                                   const IsosurfaceOptions& options)
    : device_(std::move(device)),
      options_(options),
      type_(volume.type),
      clock_(device_, 3),
      staging_(device_),
      samples_(device_, staging_, volume, options_.progress),
      commands_(device_) {
    samples_.describe(parameters_);
    const IndexToPhysical to_physical(volume);
    const int pad = options_.closed ? 1 : 0;
    parameters_.grid_rows = {parameters_.dims[1] + 2 * pad, parameters_.dims[2] + 2 * pad};
    parameters_.leaf_words = (parameters_.row_words + static_cast<std::uint32_t>(pad) + 3) / 4 * 4;
    parameters_.matrix = to_physical.matrix;
    parameters_.normal_matrix = to_physical.normal_matrix;
    parameters_.axis = to_physical.axis;
    parameters_.cases = pack_cases(to_physical.mirrored);

    const std::uint64_t leaves = rows() * parameters_.leaf_words;
    ranges_ = DeviceBuffer(device_, 2 * samples_.blocks() * sizeof(std::uint32_t));
    list_ = DeviceBuffer(device_, samples_.blocks() * sizeof(std::uint32_t));
    bits_ = DeviceBuffer(device_, samples_.bit_words() * sizeof(std::uint32_t));
    points_ = DevicePyramid(device_, 3 * leaves);
    triangles_ = DevicePyramid(device_, leaves);
    status_ = DeviceBuffer(device_, sizeof(Status));
    parameter_block_ = DeviceBuffer(device_, sizeof(Parameters));
    report_memory_ = DeviceBuffer(device_, sizeof(Report), DeviceBuffer::Place::host);
    upload_row_bases(to_physical);

    parameters_.ranges = ranges_.address();
    parameters_.list = list_.address();
    parameters_.bits = bits_.address();
    parameters_.row_bases = row_bases_.address();
    parameters_.status = status_.address();
    parameters_.pyramids = {points_.parameters(), triangles_.parameters()};
    find_ranges();
}

std::uint64_t DeviceExtraction::rows() const {
    return static_cast<std::uint64_t>(parameters_.grid_rows[0]) *
           static_cast<std::uint64_t>(parameters_.grid_rows[1]);
}

std::uint64_t DeviceExtraction::scratch_bytes() const {
    return ranges_.bytes() + list_.bytes() + bits_.bytes() + row_bases_.bytes() + points_.bytes() +
           triangles_.bytes();
}

void DeviceExtraction::upload_row_bases(const IndexToPhysical& to_physical) {
    row_bases_ = DeviceBuffer(device_, rows() * sizeof(Vec3f));
    const std::int64_t pad = options_.closed ? 1 : 0;
    const auto grid_ny = static_cast<std::uint64_t>(parameters_.grid_rows[0]);
    staging_.upload(row_bases_, sizeof(Vec3f), [&](std::uint64_t row, std::byte* to) {
        const Vec3f base = to_physical.row_base(static_cast<std::int64_t>(row % grid_ny) - pad,
                                                static_cast<std::int64_t>(row / grid_ny) - pad);
        std::memcpy(to, &base, sizeof(base));
    });
}

// Finds what does not depend on the isovalue.
void DeviceExtraction::find_ranges() {
    commands_.run(
        [&](VkCommandBuffer commands) {
            vkCmdFillBuffer(commands, status_.handle(), 0, VK_WHOLE_SIZE, 0);
            update_parameters(commands);
            dispatch(commands, Kernel::ranges, samples_.blocks());
            barrier(commands, kKernel, kKernel | kCopy);
        },
        options_.progress, 1);
}

// Everything is in one batch of commands. The output is written into the memory that is there. Only if it
// does not suffice, which only the count says, a second batch follows.
Report DeviceExtraction::extract(double isovalue, bool release) {
    report_progress(options_.progress, 0);
    parameters_.half_isovalue = 0.5f * static_cast<float>(isovalue);
    parameters_.threshold = ordered_threshold(type_, isovalue);
    const bool has_output = bytes_of(positions_) != 0;
    commands_.wait(options_.progress, 0);  // for a surface that was cancelled
    commands_.start([&](VkCommandBuffer commands) {
        clock_.reset(commands);
        vkCmdFillBuffer(commands, status_.handle(), offsetof(Status, unsafe), VK_WHOLE_SIZE, 0);
        update_parameters(commands);
        clock_.stamp(commands, 0);
        classify(commands);
        clock_.stamp(commands, 1);
        count(commands);
        clock_.stamp(commands, 2);
        if (has_output) emit(commands, release);
        copy_report(commands);
    });
    parameters_.has_previous = 0;  // the bits are being changed
    commands_.wait(options_.progress, 0);
    parameters_.previous_threshold = parameters_.threshold;
    parameters_.has_previous = 1;
    Report report = read_report();
    check_size(report);
    report_progress(options_.progress, 0.5);
    if (!has_room(report)) {
        make_room(report);
        commands_.run(
            [&](VkCommandBuffer commands) {
                update_parameters(commands);
                emit(commands, release);
                copy_report(commands);
            },
            options_.progress, 0.5);
        report = read_report();
    }
    if (report.status.unsafe != 0)
        throw DeviceError(
            device_->name() +
            ": a point or normal depends on numbers nearer to zero than 2^-100 or above 2^126, which "
            "devices may round in other ways; use the CPU");
    return report;
}

void DeviceExtraction::update_parameters(VkCommandBuffer commands) {
    parameters_.points = address_of(positions_);
    parameters_.normals = address_of(normals_);
    parameters_.triangles = address_of(indices_);
    const auto room = [&](std::uint64_t bytes) {
        return static_cast<std::uint32_t>(std::min(bytes / sizeof(Vec3f), device_->limits().elements - 1));
    };
    static_assert(sizeof(Vec3f) == sizeof(Triangle));
    parameters_.room = {options_.normals ? std::min(room(bytes_of(positions_)), room(bytes_of(normals_)))
                                         : room(bytes_of(positions_)),
                        room(bytes_of(indices_))};
    vkCmdUpdateBuffer(commands, parameter_block_.handle(), 0, sizeof(parameters_), &parameters_);
    barrier(commands, kCopy, kKernel);
}

// Adds a kernel to the commands. It sees what came before the last barrier.
void DeviceExtraction::dispatch(VkCommandBuffer commands, Kernel kernel, std::uint64_t elements,
                                std::uint32_t which, std::uint32_t level) const {
    const Specialization constants{static_cast<std::int32_t>(type_), options_.closed, options_.normals};
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, device_->pipeline(kernel, constants));
    const Push push{parameter_block_.address(), which, level};
    vkCmdPushConstants(commands, device_->layout(), VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof(push), &push);
    constexpr std::uint64_t kGroup = 256;  // as in the shaders
    const std::uint64_t groups =
        std::min<std::uint64_t>((elements + kGroup - 1) / kGroup, device_->limits().groups);
    vkCmdDispatch(commands, static_cast<std::uint32_t>(groups), 1, 1);
}

// Changes the bits from those of the threshold before, if there was one.
void DeviceExtraction::classify(VkCommandBuffer commands) const {
    dispatch(commands, Kernel::select, samples_.blocks());
    barrier(commands, kKernel, kKernel);
    dispatch(commands, Kernel::classify, samples_.loads());
    barrier(commands, kKernel, kKernel);
}

// Counts, and builds the pyramids from the leaves up and then from the apex down.
void DeviceExtraction::count(VkCommandBuffer commands) const {
    dispatch(commands, Kernel::count, rows() * parameters_.leaf_words / 4);
    barrier(commands, kKernel, kKernel);
    const auto& pyramids = parameters_.pyramids;
    const std::uint32_t top = std::max(pyramids[0].top, pyramids[1].top);
    for (std::uint32_t level = 1; level <= top; ++level) {
        for (std::uint32_t p = 0; p < 2; ++p) {
            if (level <= pyramids[p].top)
                dispatch(commands, Kernel::reduce, pyramids[p].size[level], p, level);
        }
        barrier(commands, kKernel, kKernel | kCopy);
    }
    for (std::uint32_t level = top; level >= 2; --level) {
        for (std::uint32_t p = 0; p < 2; ++p) {
            if (level <= pyramids[p].top)
                dispatch(commands, Kernel::descend, pyramids[p].size[level], p, level);
        }
        barrier(commands, kKernel, kKernel);
    }
}

void DeviceExtraction::emit(VkCommandBuffer commands, bool release) const {
    dispatch(commands, Kernel::points, parameters_.room[0]);
    if (parameters_.room[1] > 0) dispatch(commands, Kernel::triangles, parameters_.room[1]);
    barrier(commands, kKernel, kKernel | kCopy);
    if (release) release_output(commands);
}

// Hands the output over to other instances of Vulkan, CUDA or OpenGL. It need not be acquired again, because
// the next surface replaces its content.
void DeviceExtraction::release_output(VkCommandBuffer commands) const {
    if (!device_->limits().exports_memory) return;
    std::vector<VkBufferMemoryBarrier> barriers;
    for (const Output* output : {&positions_, &normals_, &indices_}) {
        if (!*output) continue;
        VkBufferMemoryBarrier& b = barriers.emplace_back();
        b.sType = VK_STRUCTURE_TYPE_BUFFER_MEMORY_BARRIER;
        b.srcAccessMask = VK_ACCESS_SHADER_WRITE_BIT;
        b.srcQueueFamilyIndex = device_->queue_family();
        b.dstQueueFamilyIndex = VK_QUEUE_FAMILY_EXTERNAL;
        b.buffer = (*output)->handle();
        b.size = VK_WHOLE_SIZE;
    }
    vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_PIPELINE_STAGE_BOTTOM_OF_PIPE_BIT,
                         0, 0, nullptr, static_cast<std::uint32_t>(barriers.size()), barriers.data(), 0,
                         nullptr);
}

void DeviceExtraction::copy_report(VkCommandBuffer commands) const {
    const auto copy = [&](VkBuffer from, std::uint64_t begin, std::size_t to, std::uint64_t bytes) {
        const VkBufferCopy region{begin, to, bytes};
        vkCmdCopyBuffer(commands, from, report_memory_.handle(), 1, &region);
    };
    copy(status_.handle(), 0, offsetof(Report, status), sizeof(Status));
    copy(points_.nodes(), points_.apex_offset(), offsetof(Report, points), sizeof(std::uint32_t));
    copy(triangles_.nodes(), triangles_.apex_offset(), offsetof(Report, triangles), sizeof(std::uint32_t));
    barrier(commands, kCopy, kHost);
}

Report DeviceExtraction::read_report() const {
    Report report;
    std::memcpy(&report, report_memory_.mapped(), sizeof(report));
    return report;
}

// Sums that do not fit in 32 bits are the greatest number.
void DeviceExtraction::check_size(const Report& totals) const {
    if (std::max(totals.points, totals.triangles) >= device_->limits().elements)
        throw DeviceError(device_->name() +
                          ": the surface has too many points or triangles for the device; use the CPU");
}

bool DeviceExtraction::has_room(const Report& totals) const {
    return totals.points <= parameters_.room[0] && totals.triangles <= parameters_.room[1];
}

void DeviceExtraction::make_room(const Report& totals) {
    grow(device_, positions_, totals.points * sizeof(Vec3f));
    if (options_.normals) grow(device_, normals_, totals.points * sizeof(Vec3f));
    if (totals.triangles > 0) grow(device_, indices_, totals.triangles * sizeof(Triangle));
}

void DeviceExtraction::download(const Report& totals, Mesh& mesh) {
    std::vector<Download> downloads;
    const auto add = [&](const Output& from, auto& to, std::size_t count) {
        if (count > 0) downloads.push_back({from.get(), count * sizeof(to[0]), resize(to, count)});
    };
    add(positions_, mesh.points, totals.points);
    if (options_.normals) add(normals_, mesh.normals, totals.points);
    add(indices_, mesh.triangles, totals.triangles);
    std::uint64_t bytes = 0;
    for (const Download& download : downloads) bytes += download.bytes;
    Stage stage(options_.progress, 0.5, 1, bytes);
    staging_.download(downloads, [&](std::uint64_t copied) { stage.step(static_cast<double>(copied)); });
}

}  // namespace marrow::gpu::internal
