/// Decodes the JPEG streams of medical images by DCMTK; common libraries do not support all their forms.
#pragma once

#include <cstdint>
#include <string_view>

#include "codec.h"

namespace marrow::internal::io {

/// Decodes a Huffman-coded stream of one component: sequential or progressive with 8 or 12 bits, or lossless
/// with 2 to 16 bits. \throw InputError it is damaged, truncated, of another kind or another size; the
/// message continues a file name
DecodedFrame decode_grey_jpeg(std::string_view stream, std::int64_t columns, std::int64_t rows);

}  // namespace marrow::internal::io
