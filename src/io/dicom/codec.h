// Compressed DICOM frames.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace marrow {

/// How many bytes of pixels a byte in a compressed transfer syntax can become: JPEG, JPEG-LS, JPEG 2000, RLE.
/// 0 for syntaxes that decode_frame does not know.
double most_inflation(const std::string& uid);

/// Cells of one, two or four bytes, little-endian, of which the lowest `bits` are meant.
struct DecodedFrame {
    std::vector<char> cells;
    int cell_size = 0;
    int bits = 0;
};

/// Decodes one frame. `bits_allocated`, `bits_stored`: of the header, which other streams than RLE have
/// themselves. \pre most_inflation(syntax_uid) > 0. \throw InputError, in words that go after a file's name.
DecodedFrame decode_frame(const std::string& syntax_uid, std::string_view stream, std::int64_t columns,
                          std::int64_t rows, int bits_allocated, int bits_stored);

}  // namespace marrow
