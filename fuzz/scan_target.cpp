// Any bytes as a scan file: read_scan returns a volume or throws what it promises. FUZZ_FILE is the file's name,
// whose ending picks the reader where the content does not.
#include <fcntl.h>
#include <unistd.h>

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>

#include <marrow/error.h>
#include <marrow/scan_io.h>

namespace {

namespace fs = std::filesystem;

// A folder in memory where there is one, gone at the end.
struct Place {
    fs::path folder = [] {
        std::string name =
            (fs::exists("/dev/shm") ? "/dev/shm" : "/tmp") + std::string("/marrow-fuzz-XXXXXX");
        if (!mkdtemp(name.data())) std::abort();
        return name;
    }();
    ~Place() { fs::remove_all(folder); }
};

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
    static const Place place;
    const fs::path path = place.folder / FUZZ_FILE;
    const int file = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    const bool written = file >= 0 && write(file, data, size) == static_cast<ssize_t>(size);
    if (!written || close(file) != 0) std::abort();

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
