// Reads any bytes as a scan file: read_scan must return a valid volume or throw an Error. FUZZ_FILE is the
// name of the file; its extension selects the reader if the content is ambiguous.
#include "input_folder.h"
#include "read_any_scan.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const InputFolder folder;
    const std::filesystem::path path = folder.path / FUZZ_FILE;
    put_file(path, {reinterpret_cast<const char*>(data), size});
    read_any_scan(path, size % 3);
    return 0;
}
