// JPEG of one component, in the forms that medical images have and common libraries do not read, decoded by DCMTK.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

namespace marrow {

struct GreyJpeg {
    int bits = 0;                        ///< of a sample, 2 to 16
    std::vector<std::uint16_t> samples;  ///< columns fastest
};

/// Decodes a whole stream, Huffman-coded: by cosine transform, sequential or progressive, with 8 or 12 bits, or
/// lossless with 2 to 16. \throw InputError where it is
/// damaged, truncated, of another kind or not of this size, in words that go after a file's name.
GreyJpeg decode_grey_jpeg(std::string_view stream, std::int64_t columns, std::int64_t rows);

}  // namespace marrow
