// The passes of the extraction on a device, in order: classify, count, emit.
#include <marrow/gpu.h>

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>

#include "base/progress.h"
#include "base/resize_discarding.h"
#include "core/grid/index_to_physical.h"
#include "core/grid/threshold.h"
#include "core/marching_cubes/case_table.h"
#include "core/volume/checks.h"
#include "device_pyramid.h"
#include "resident_volume.h"

namespace marrow::gpu {

using namespace internal;
using namespace marrow::internal;

namespace {

using Clock = std::chrono::steady_clock;

void check(const VolumeView& volume, const IsosurfaceOptions& options) {
    check_volume(volume);
    if (options.snap != 0 || options.topology)
        throw DeviceError("GPUs extract without options.snap and options.topology; use the CPU");
    if (volume.type == SampleType::int32 || volume.type == SampleType::float64)
        throw DeviceError(std::string("GPUs take no samples of type ") + sample_type_name(volume.type) +
                          "; use the CPU");
}

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
std::array<std::uint64_t, 256> pack_cases(bool mirrored) {
    const std::array<Case, 256>& cases = mirrored ? kMirroredCases : kCases;
    std::array<std::uint64_t, 256> packed{};
    for (std::size_t c = 0; c < 256; ++c) {
        packed[c] = std::uint64_t{cases[c].triangles} << 60;
        for (std::size_t k = 0; k < 3 * kMaxTriangles; ++k)
            packed[c] |= std::uint64_t{cases[c].edges[k]} << 4 * k;
    }
    return packed;
}

// What the kernels report to the host.
struct Report {
    std::uint32_t non_finite, unsafe;  // as in Parameters::status
    std::uint32_t points, triangles;
};

// The volume on a device, and all memory that its surfaces take.
class DeviceExtraction {
  public:
    DeviceExtraction(std::shared_ptr<VulkanDevice> vulkan, const VolumeView& volume,
                     const IsosurfaceOptions& options)
        : device_(std::move(vulkan)),
          options_(options),
          type_(volume.type),
          staging_(device_),
          samples_(device_, staging_, volume, options_.progress) {
        samples_.describe(parameters_);
        const IndexToPhysical to_physical(volume);
        const int pad = options_.closed ? 1 : 0;
        parameters_.grid_rows = {parameters_.dims[1] + 2 * pad, parameters_.dims[2] + 2 * pad};
        parameters_.leaf_words = (parameters_.row_words + static_cast<std::uint32_t>(pad) + 3) / 4 * 4;
        parameters_.matrix = to_physical.matrix;
        parameters_.normal_matrix = to_physical.normal_matrix;
        parameters_.axis = to_physical.axis;

        ranges_ = DeviceBuffer(device_, 2 * samples_.blocks() * sizeof(std::uint32_t));
        bits_ = DeviceBuffer(device_, samples_.bit_words() * sizeof(std::uint32_t));
        points_ = DevicePyramid(device_, 3 * leaves());
        triangles_ = DevicePyramid(device_, leaves());
        row_bases_ = DeviceBuffer(device_, rows() * sizeof(Vec3f));
        const auto grid_ny = static_cast<std::uint64_t>(parameters_.grid_rows[0]);
        staging_.upload(row_bases_, sizeof(Vec3f), [&](std::uint64_t row, std::byte* to) {
            const Vec3f base = to_physical.row_base(static_cast<std::int64_t>(row % grid_ny) - pad,
                                                    static_cast<std::int64_t>(row / grid_ny) - pad);
            std::memcpy(to, &base, sizeof(base));
        });
        const auto packed = pack_cases(to_physical.mirrored);
        cases_ = DeviceBuffer(device_, sizeof(packed));
        staging_.upload(cases_, sizeof(packed), [&](std::uint64_t, std::byte* to) {
            std::memcpy(to, packed.data(), sizeof(packed));
        });
        status_ = DeviceBuffer(device_, 2 * sizeof(std::uint32_t));
        parameter_block_ = DeviceBuffer(device_, sizeof(Parameters));
        report_memory_ = DeviceBuffer(device_, sizeof(Report), DeviceBuffer::Place::host);

        parameters_.ranges = ranges_.address();
        parameters_.bits = bits_.address();
        parameters_.row_bases = row_bases_.address();
        parameters_.cases = cases_.address();
        parameters_.status = status_.address();
        parameters_.pyramids = {points_.parameters(), triangles_.parameters()};

        find_ranges();
    }

    void extract(double isovalue, Mesh& mesh, IsosurfaceStats& stats) {
        const auto start = Clock::now();
        parameters_.half_isovalue = 0.5f * static_cast<float>(isovalue);
        classify(ordered_threshold(type_, isovalue));
        report_progress(options_.progress, 0.3);
        const auto classified = Clock::now();
        count();
        const Report totals = read_report();
        report_progress(options_.progress, 0.4);
        // An index in a shader has 31 bits. Sums that do not fit in 32 are the greatest number.
        if (std::max(totals.points, totals.triangles) >
            std::uint32_t{std::numeric_limits<std::int32_t>::max()})
            throw DeviceError(device_->name() +
                              ": the surface has more than 2^31 points or triangles; use the CPU");
        const auto counted = Clock::now();
        if (totals.points > 0) {
            emit(totals);
            report_progress(options_.progress, 0.8);
            if (read_report().unsafe != 0)
                throw DeviceError(
                    device_->name() +
                    ": a point or normal depends on numbers nearer to zero than "
                    "2^-100 or above 2^126, which devices may round in other ways; use the CPU");
            download(positions_, totals.points, mesh.points);
            if (options_.normals) download(normals_, totals.points, mesh.normals);
            download(indices_, totals.triangles, mesh.triangles);
        }
        report_progress(options_.progress, 1);
        const auto seconds = [](Clock::time_point from, Clock::time_point to) {
            return std::chrono::duration<double>(to - from).count();
        };
        stats = {totals.non_finite, static_cast<std::int64_t>(scratch_bytes()), seconds(start, classified),
                 seconds(classified, counted), seconds(counted, Clock::now())};
    }

  private:
    std::uint64_t rows() const {
        return static_cast<std::uint64_t>(parameters_.grid_rows[0]) *
               static_cast<std::uint64_t>(parameters_.grid_rows[1]);
    }
    std::uint64_t leaves() const { return rows() * parameters_.leaf_words; }
    std::uint64_t scratch_bytes() const {
        return ranges_.bytes() + bits_.bytes() + row_bases_.bytes() + cases_.bytes() + points_.bytes() +
               triangles_.bytes();
    }

    // Adds a kernel with one invocation for each of `count` elements to the commands. It sees what came before
    // the last barrier.
    void dispatch(VkCommandBuffer commands, Kernel kernel, std::uint64_t count, std::uint32_t which = 0,
                  std::uint32_t level = 0) const {
        const Specialization constants{static_cast<std::int32_t>(type_), options_.closed, options_.normals};
        vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, device_->pipeline(kernel, constants));
        const Push push{parameter_block_.address(), which, level};
        vkCmdPushConstants(commands, device_->layout(), VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof(push), &push);
        constexpr std::uint64_t kGroup = 256;  // as in the shaders
        const std::uint64_t groups = (count + kGroup - 1) / kGroup;
        const std::uint64_t x = std::min<std::uint64_t>(groups, device_->limits().groups);
        vkCmdDispatch(commands, static_cast<std::uint32_t>(x),
                      static_cast<std::uint32_t>((groups + x - 1) / x), 1);
    }

    // Finds what does not depend on the isovalue.
    void find_ranges() {
        device_->run([&](VkCommandBuffer commands) {
            vkCmdUpdateBuffer(commands, parameter_block_.handle(), 0, sizeof(parameters_), &parameters_);
            vkCmdFillBuffer(commands, status_.handle(), 0, VK_WHOLE_SIZE, 0);
            barrier(commands);
            dispatch(commands, Kernel::ranges, samples_.blocks());
            barrier(commands);
        });
    }

    // Changes the bits from the threshold before, if there was one, to `threshold`.
    void classify(std::int32_t threshold) {
        parameters_.threshold = threshold;
        device_->run([&](VkCommandBuffer commands) {
            vkCmdUpdateBuffer(commands, parameter_block_.handle(), 0, sizeof(parameters_), &parameters_);
            vkCmdFillBuffer(commands, status_.handle(), offsetof(Report, unsafe), sizeof(std::uint32_t), 0);
            barrier(commands);
            dispatch(commands, Kernel::classify, samples_.bit_words());
            barrier(commands);
        });
        parameters_.previous_threshold = threshold;
        parameters_.has_previous = 1;
    }

    // Counts, and builds the pyramids from the leaves up and then from the apex down.
    void count() {
        device_->run([&](VkCommandBuffer commands) {
            dispatch(commands, Kernel::count, leaves() / 4);
            barrier(commands);
            const auto& pyramids = parameters_.pyramids;
            const std::uint32_t top = std::max(pyramids[0].top, pyramids[1].top);
            for (std::uint32_t level = 1; level <= top; ++level) {
                for (std::uint32_t p = 0; p < 2; ++p) {
                    if (level <= pyramids[p].top)
                        dispatch(commands, Kernel::reduce, pyramids[p].size[level], p, level);
                }
                barrier(commands);
            }
            for (std::uint32_t level = top; level >= 2; --level) {
                for (std::uint32_t p = 0; p < 2; ++p) {
                    if (level <= pyramids[p].top)
                        dispatch(commands, Kernel::descend, pyramids[p].size[level], p, level);
                }
                barrier(commands);
            }
        });
    }

    void emit(const Report& totals) {
        grow(positions_, totals.points * sizeof(Vec3f));
        if (options_.normals) grow(normals_, totals.points * sizeof(Vec3f));
        grow(indices_, totals.triangles * sizeof(Triangle));
        parameters_.points = positions_.address();
        parameters_.normals = normals_.address();
        parameters_.triangles = indices_.address();
        device_->run([&](VkCommandBuffer commands) {
            vkCmdUpdateBuffer(commands, parameter_block_.handle(), 0, sizeof(parameters_), &parameters_);
            barrier(commands);
            dispatch(commands, Kernel::points, totals.points);
            if (totals.triangles > 0) dispatch(commands, Kernel::triangles, totals.triangles);
            barrier(commands);
        });
    }

    // Makes room for output, and for somewhat more, so that the next isovalue need not.
    void grow(DeviceBuffer& buffer, std::uint64_t bytes) {
        if (buffer.bytes() >= bytes) return;
        buffer = {};
        const std::uint64_t more = std::min(bytes + bytes / 4, device_->limits().allocation);
        buffer = DeviceBuffer(device_, std::max(bytes, more / 4 * 4));
    }

    Report read_report() {
        device_->run([&](VkCommandBuffer commands) {
            const auto copy = [&](VkBuffer from, std::uint64_t begin, std::size_t to, std::uint64_t bytes) {
                const VkBufferCopy region{begin, to, bytes};
                vkCmdCopyBuffer(commands, from, report_memory_.handle(), 1, &region);
            };
            copy(status_.handle(), 0, offsetof(Report, non_finite), 2 * sizeof(std::uint32_t));
            copy(points_.nodes(), points_.apex_offset(), offsetof(Report, points), sizeof(std::uint32_t));
            copy(triangles_.nodes(), triangles_.apex_offset(), offsetof(Report, triangles),
                 sizeof(std::uint32_t));
            barrier(commands);
        });
        Report report;
        std::memcpy(&report, report_memory_.mapped(), sizeof(report));
        return report;
    }

    template <class T>
    void download(const DeviceBuffer& from, std::size_t count, Buffer<T>& to) {
        try {
            resize_discarding(to, count);
        } catch (const std::bad_alloc&) {
            throw LimitError("there is not enough memory for the surface; crop or coarsen the volume");
        }
        staging_.download(from, count * sizeof(T), to.data());
    }

    const std::shared_ptr<VulkanDevice> device_;
    const IsosurfaceOptions options_;
    const SampleType type_;
    Staging staging_;
    const ResidentVolume samples_;
    Parameters parameters_;
    DeviceBuffer parameter_block_, status_, report_memory_;
    DeviceBuffer ranges_, bits_, row_bases_, cases_;
    DevicePyramid points_, triangles_;
    DeviceBuffer positions_, normals_, indices_;  // the output
};

}  // namespace

// Where the volume has no cells there is never a surface, and nothing on the device.
struct Extractor::Impl {
    std::optional<DeviceExtraction> extraction;
    Mesh mesh;  // of those who gave none
};

Extractor::Extractor(const VolumeView& volume, const IsosurfaceOptions& options, std::size_t device)
    : impl_(std::make_unique<Impl>()) {
    check(volume, options);
    std::shared_ptr<VulkanDevice> vulkan = open_device(device);
    if (has_cells(volume.geometry, options.closed))
        impl_->extraction.emplace(std::move(vulkan), volume, options);
}

Extractor::~Extractor() = default;
Extractor::Extractor(Extractor&&) noexcept = default;
Extractor& Extractor::operator=(Extractor&&) noexcept = default;

void Extractor::extract(double isovalue, Mesh& mesh, IsosurfaceStats* stats) {
    check_isovalue(isovalue);
    resize_discarding(mesh.points, 0);
    resize_discarding(mesh.normals, 0);
    resize_discarding(mesh.triangles, 0);
    IsosurfaceStats measured;
    if (impl_->extraction) impl_->extraction->extract(isovalue, mesh, measured);
    if (stats != nullptr) *stats = measured;
}

const Mesh& Extractor::extract(double isovalue, IsosurfaceStats* stats) {
    extract(isovalue, impl_->mesh, stats);
    return impl_->mesh;
}

}  // namespace marrow::gpu
