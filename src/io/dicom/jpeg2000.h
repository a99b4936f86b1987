/// Decodes JPEG 2000.
#pragma once

#include <cstdint>
#include <string_view>

#include "codec.h"

namespace marrow::internal::io {

/// Whether the linked OpenJPEG decodes the high-throughput form of JPEG 2000 (ITU-T T.814). Before 2.5.1,
/// damaged streams of that form end the process by an assertion, or write beyond a buffer.
bool decodes_high_throughput();

/// Decodes a stream of one component, also within the boxes of JP2. \throw InputError it is damaged,
/// truncated, of another size, or in the high-throughput form where that is not decoded; the message
/// continues a file name; LimitError
DecodedFrame decode_jpeg2000(std::string_view stream, std::int64_t columns, std::int64_t rows);

}  // namespace marrow::internal::io
