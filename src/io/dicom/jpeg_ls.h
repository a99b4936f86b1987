/// Decodes JPEG-LS.
#pragma once

#include <cstdint>
#include <string_view>

#include "codec.h"

namespace marrow::internal::io {

/// Decodes a lossless or near-lossless stream of one component. \throw InputError it is damaged, truncated or
/// of another size; the message continues a file name
DecodedFrame decode_jpeg_ls(std::string_view stream, std::int64_t columns, std::int64_t rows);

}  // namespace marrow::internal::io
