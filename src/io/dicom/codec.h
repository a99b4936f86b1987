/// Decodes compressed DICOM frames: JPEG, JPEG-LS, JPEG 2000 and run lengths.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace marrow::internal::io {

/// The most bytes of pixels that one byte in a compressed transfer syntax can become. 0 if decode_frame does
/// not support the syntax.
double most_inflation(const std::string& uid);

/// Whether a compressed transfer syntax always keeps the samples as they are.
bool is_lossless(const std::string& uid);

/// Pixel cells of one, two or four bytes, little-endian. The lowest `bits` bits of a cell hold the sample.
struct DecodedFrame {
    std::vector<char> cells;
    int cell_size = 0;
    int bits = 0;
};

/// Checks what a stream claims. \throw InputError it is not one component of the
/// wanted size, with 2 to 16 bits
void check_size(std::int64_t columns, std::int64_t rows, std::int64_t components, int bits,
                std::int64_t wanted_columns, std::int64_t wanted_rows);

/// Decodes one frame. `bits_allocated` and `bits_stored` are from the header; only run lengths need them,
/// because the other streams state them.
/// \pre most_inflation(syntax_uid) > 0. \throw InputError with a message that continues a file name;
/// LimitError
DecodedFrame decode_frame(const std::string& syntax_uid, std::string_view stream, std::int64_t columns,
                          std::int64_t rows, int bits_allocated, int bits_stored);

}  // namespace marrow::internal::io
