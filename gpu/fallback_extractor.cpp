// Extracts on a device until it fails, and then on the CPU.
#include <marrow/gpu.h>

#include <cmath>
#include <map>
#include <utility>

namespace marrow::gpu {

namespace {

// What went wrong, without the name of the device, and without the advice to use the CPU, which is followed.
std::string reason_in(const std::string& message, const std::string& device) {
    const std::size_t begin = message.starts_with(device + ": ") ? device.size() + 2 : 0;
    const std::size_t end = message.ends_with("use the CPU") ? message.rfind("; ") : message.size();
    return message.substr(begin, end - begin);
}

}  // namespace

struct FallbackExtractor::Impl {
    Impl(const VolumeView& view, const IsosurfaceOptions& extraction_options)
        : volume(view), options(extraction_options) {
        if (!options.progress) return;
        options.progress = [this, report = options.progress](double fraction) {
            done = std::lerp(begin, 1.0, fraction);
            return report(done);
        };
    }

    VolumeView volume;
    IsosurfaceOptions options;
    double begin = 0, done = 0;  // of the progress: where the extractor began, and what was reported last
    std::string device_name;
    std::optional<Extractor> device;
    std::optional<IsosurfaceExtractor> cpu;  // made when it is first needed
    std::string failure;
    std::map<int, Mesh> meshes;  // of the levels that were extracted without a mesh of the caller

    // Calls `work`, which uses the device. Returns whether it succeeded; if not, the device is given up.
    template <class Work>
    bool try_device(const Work& work) {
        try {
            work();
            return true;
        } catch (const DeviceError& error) {
            failure = reason_in(error.what(), device_name);
            device.reset();
            begin = done;  // the CPU does what is left
            return false;
        }
    }

    IsosurfaceExtractor& on_cpu() {
        if (!cpu) cpu.emplace(volume, options);
        return *cpu;
    }
};

FallbackExtractor::FallbackExtractor(const VolumeView& volume, const IsosurfaceOptions& options,
                                     std::optional<std::size_t> device)
    : impl_(std::make_unique<Impl>(volume, options)) {
    if (const auto known = devices(); device && *device < known.size())
        impl_->device_name = known[*device].name;
    if (device) impl_->try_device([&] { impl_->device.emplace(volume, impl_->options, *device); });
    if (!impl_->device) impl_->on_cpu();
}

FallbackExtractor::~FallbackExtractor() = default;
FallbackExtractor::FallbackExtractor(FallbackExtractor&&) noexcept = default;
FallbackExtractor& FallbackExtractor::operator=(FallbackExtractor&&) noexcept = default;

void FallbackExtractor::extract(double isovalue, Mesh& mesh, int level, IsosurfaceStats* stats) {
    impl_->begin = impl_->done = 0;
    const bool done = level == 0 && impl_->device &&
                      impl_->try_device([&] { impl_->device->extract(isovalue, mesh, stats); });
    if (!done) impl_->on_cpu().extract(isovalue, mesh, level, stats);
}

const Mesh& FallbackExtractor::extract(double isovalue, int level, IsosurfaceStats* stats) {
    Mesh& mesh = impl_->meshes[level];
    extract(isovalue, mesh, level, stats);
    return mesh;
}

bool FallbackExtractor::on_device() const {
    return impl_->device.has_value();
}

const std::string& FallbackExtractor::failure() const {
    return impl_->failure;
}

}  // namespace marrow::gpu
