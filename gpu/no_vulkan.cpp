// Takes the place of all that uses Vulkan where Marrow is built without it: there are no devices.
#include <marrow/gpu.h>

namespace marrow::gpu {

std::vector<Device> devices() {
    return {};
}

std::vector<UnusableDevice> unusable_devices() {
    return {};
}

std::string why_no_devices() {
    return "Marrow was built without Vulkan (MARROW_GPU)";
}

std::uint64_t DeviceArray::allocation() const {
    return 0;
}

std::uint64_t DeviceArray::id() const {
    return 0;
}

int DeviceArray::export_fd() const {
    throw InputError("the array is empty, so it has no memory to export");
}

struct Extractor::Impl {};

Extractor::Extractor(const VolumeView&, const IsosurfaceOptions&, std::size_t) {
    throw DeviceError(why_no_devices() + "; use the CPU");
}

Extractor::~Extractor() = default;
Extractor::Extractor(Extractor&&) noexcept = default;
Extractor& Extractor::operator=(Extractor&&) noexcept = default;

// There is no extractor that these could be called for, except one that was moved from.
void Extractor::extract(double, Mesh&, IsosurfaceStats*) {
    throw DeviceError(why_no_devices() + "; use the CPU");
}

const Mesh& Extractor::extract(double, IsosurfaceStats*) {
    throw DeviceError(why_no_devices() + "; use the CPU");
}

const DeviceMesh& Extractor::extract_on_device(double, IsosurfaceStats*) {
    throw DeviceError(why_no_devices() + "; use the CPU");
}

}  // namespace marrow::gpu
