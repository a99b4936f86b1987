// The public face of the extraction on a device.
#include <marrow/gpu.h>

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "base/progress.h"
#include "base/resize_discarding.h"
#include "core/volume/check_options.h"
#include "core/volume/checks.h"
#include "device_extraction.h"

namespace marrow::gpu {

using namespace internal;
using namespace marrow::internal;

namespace {

void check(const VolumeView& volume, const IsosurfaceOptions& options) {
    check_options(options);
    check_volume(volume);
    if (options.snap != 0 || options.topology)
        throw DeviceError("GPUs neither snap points nor give exact topology; use the CPU");
    if (volume.type == SampleType::int32 || volume.type == SampleType::float64)
        throw DeviceError(std::string("GPUs take no samples of type ") + sample_type_name(volume.type) +
                          "; use the CPU");
}

}  // namespace

std::uint64_t DeviceArray::allocation() const {
    return memory_ ? memory_->allocation() : 0;
}

std::uint64_t DeviceArray::id() const {
    return memory_ ? memory_->id() : 0;
}

int DeviceArray::export_fd() const {
    if (!memory_) throw InputError("the array is empty, so it has no memory to export");
    return memory_->export_fd();
}

// Where the volume has no cells there is never a surface, and nothing on the device.
struct Extractor::Impl {
    std::optional<DeviceExtraction> extraction;
    Rescale rescale;
    Progress progress;
    Mesh mesh;               // of those who gave none
    DeviceMesh device_mesh;  // the last one

    // Extracts, and calls use(report) for what is left to do.
    template <class F>
    void extract(double isovalue, bool release, IsosurfaceStats* stats, const F& use) {
        const double sample_isovalue = checked_isovalue(isovalue, rescale);
        IsosurfaceStats measured;
        if (extraction) {
            using Clock = std::chrono::steady_clock;
            const auto start = Clock::now();
            const Report report = extraction->extract(sample_isovalue, release);
            use(report);
            measured.non_finite_samples = static_cast<std::int64_t>(report.status.not_finite);
            measured.scratch_bytes = static_cast<std::int64_t>(extraction->scratch_bytes());
            measured.classify_seconds = extraction->classify_seconds();
            measured.count_seconds = extraction->count_seconds();
            measured.emit_seconds = std::chrono::duration<double>(Clock::now() - start).count() -
                                    measured.classify_seconds - measured.count_seconds;
            report_progress(progress, 1);
        }
        if (stats != nullptr) *stats = measured;
    }
};

Extractor::Extractor(const VolumeView& volume, const IsosurfaceOptions& options, std::size_t device)
    : impl_(std::make_unique<Impl>()) {
    check(volume, options);
    std::shared_ptr<VulkanDevice> vulkan = open_device(device);
    impl_->rescale = volume.rescale;
    impl_->progress = options.progress;
    if (has_cells(volume.geometry, options.closed))
        impl_->extraction.emplace(std::move(vulkan), volume, options);
}

Extractor::~Extractor() = default;
Extractor::Extractor(Extractor&&) noexcept = default;
Extractor& Extractor::operator=(Extractor&&) noexcept = default;

void Extractor::extract(double isovalue, Mesh& mesh, IsosurfaceStats* stats) {
    resize_discarding(mesh.points, 0);
    resize_discarding(mesh.normals, 0);
    resize_discarding(mesh.triangles, 0);
    impl_->extract(isovalue, false, stats,
                   [&](const Report& report) { impl_->extraction->download(report, mesh); });
}

const Mesh& Extractor::extract(double isovalue, IsosurfaceStats* stats) {
    extract(isovalue, impl_->mesh, stats);
    return impl_->mesh;
}

const DeviceMesh& Extractor::extract_on_device(double isovalue, IsosurfaceStats* stats) {
    DeviceMesh& mesh = impl_->device_mesh;
    mesh = {};
    impl_->extract(isovalue, true, stats, [&](const Report& report) {
        const auto set = [](DeviceArray& array, std::uint64_t bytes, const auto& memory) {
            if (bytes == 0) return;
            array.bytes_ = bytes;
            array.memory_ = memory;
        };
        mesh.points = report.points;
        mesh.triangles = report.triangles;
        const DeviceExtraction& extraction = *impl_->extraction;
        set(mesh.positions, report.points * sizeof(Vec3f), extraction.positions());
        if (extraction.normals()) set(mesh.normals, report.points * sizeof(Vec3f), extraction.normals());
        set(mesh.indices, report.triangles * sizeof(Triangle), extraction.indices());
    });
    return mesh;
}

}  // namespace marrow::gpu
