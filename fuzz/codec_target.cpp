// Decodes any bytes as a compressed DICOM frame. The first four select transfer syntax and size.
#include <array>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include <marrow/error.h>

#include "io/dicom/codec.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const std::array<std::string, 7> syntaxes = {"1.2.840.10008.1.2.4.50", "1.2.840.10008.1.2.4.51",
                                                        "1.2.840.10008.1.2.4.57", "1.2.840.10008.1.2.4.70",
                                                        "1.2.840.10008.1.2.4.80", "1.2.840.10008.1.2.4.90",
                                                        "1.2.840.10008.1.2.5"};
    constexpr std::size_t kHead = 4;
    if (size < kHead) return 0;
    const int columns = data[1] + 1, rows = data[2] + 1, allocated = data[3] % 2 ? 8 : 16;
    try {
        const marrow::internal::io::DecodedFrame frame = marrow::internal::io::decode_frame(
            syntaxes[data[0] % syntaxes.size()], {reinterpret_cast<const char*>(data) + kHead, size - kHead},
            columns, rows, allocated, allocated);
        const auto needed = static_cast<std::size_t>(columns * rows * frame.cell_size);
        if (frame.cells.size() < needed || frame.bits < 1 || frame.bits > 8 * frame.cell_size) std::abort();
    } catch (const marrow::Error&) {
    }
    return 0;
}
