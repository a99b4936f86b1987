// Reads any bytes as a scan file: read_scan must return a valid volume or throw an Error. FUZZ_FILE is the
// name of the file; its extension selects the reader if the content is ambiguous.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>

#include <marrow/error.h>
#include <marrow/scan_io.h>

#include "input_folder.h"

namespace {

namespace fs = std::filesystem;

// Returns false if the scan needs an option.
bool read(const fs::path& path, const marrow::ScanOptions& options) {
    try {
        const marrow::Volume volume = marrow::read_scan(path, options);
        marrow::check_geometry(volume.geometry());
        const std::size_t expected =
            static_cast<std::size_t>(volume.geometry().sample_count()) * marrow::sample_size(volume.type());
        if (volume.bytes() != expected) std::abort();
        // Touch the samples, so that sanitizers find memory that is missing.
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
    static const InputFolder folder;
    const fs::path path = folder.path / FUZZ_FILE;
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
