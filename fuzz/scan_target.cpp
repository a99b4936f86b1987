// Any bytes as a scan file: read_scan returns a volume or throws what it promises. FUZZ_FILE is the file's name,
// whose ending picks the reader where the content does not.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>

#include <marrow/error.h>
#include <marrow/scan_io.h>

#include "file_place.h"

namespace {

namespace fs = std::filesystem;

// False where the scan is refused for want of a spacing or the like.
bool read(const fs::path& path, const marrow::ScanOptions& options) {
    try {
        const marrow::Volume volume = marrow::read_scan(path, options);
        marrow::check_geometry(volume.geometry());
        const std::size_t expected =
            static_cast<std::size_t>(volume.geometry().sample_count()) * marrow::sample_size(volume.type());
        if (volume.bytes() != expected) std::abort();
        // what was never written is found by MemorySanitizer only, but what is not there by all
        volatile unsigned char sum = 0;
        for (std::size_t i = 0; i < volume.bytes(); i += 4096)
            sum = sum + static_cast<const unsigned char*>(volume.data())[i];
        return true;
    } catch (const marrow::GeometryError&) {
        return false;
    } catch (const marrow::Error&) {
        return true;
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const FilePlace place;
    const fs::path path = place.folder / FUZZ_FILE;
    put_file(path, {reinterpret_cast<const char*>(data), size});

    marrow::ScanOptions options;
    options.threads = 1;
    if (read(path, options)) return 0;
    options.spacing = marrow::Vec3d{1, 1, 1};
    if (read(path, options)) return 0;
    options.spacing.reset();
    options.volume = size % 3;
    try {
        read(path, options);
        marrow::inspect_scan(path);
    } catch (const marrow::Error&) {
    }
    return 0;
}
