// Reads any bytes as the files of a Zarr folder: read_scan must return a valid volume or throw an Error.
#include <filesystem>

#include <marrow/error.h>

#include "input_folder.h"
#include "read_any_scan.h"
#include "zarr_files.h"

namespace {

namespace fs = std::filesystem;

void put_files(const fs::path& folder, std::string_view bytes) {
    for (std::size_t at = bytes.find(kZarrMark); at != bytes.npos;) {
        bytes.remove_prefix(at + kZarrMark.size());
        if (bytes.empty()) return;
        const fs::path path =
            folder / kZarrFiles[static_cast<unsigned char>(bytes.front()) % std::size(kZarrFiles)];
        bytes.remove_prefix(1);
        at = bytes.find(kZarrMark);
        fs::create_directories(path.parent_path());
        put_file(path, bytes.substr(0, at));
    }
}

// Missing chunks have samples but no bytes, so that a small input may well be a large volume.
bool is_small(const fs::path& path) {
    constexpr std::uint64_t kMost = 1 << 16;
    try {
        const marrow::ScanReport report = marrow::inspect_scan(path);
        return report.series[0].memory <= kMost;
    } catch (const marrow::Error&) {
        return true;
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const InputFolder folder;
    const fs::path path = folder.path / "image";
    fs::remove_all(path);
    fs::create_directories(path);
    put_files(path, {reinterpret_cast<const char*>(data), size});
    if (is_small(path)) read_any_scan(path, size % 3);
    return 0;
}
