/// DCMTK's form of the Independent JPEG Group's library, which decodes all JPEG processes of DICOM.
#pragma once

#include <string_view>
#include <vector>

namespace marrow::internal::io {

/// Decodes a stream of one component with `bits` bits into `to`, which has the size of the image: a
/// byte for each sample, or two where there are more than 8 bits. Returns false if the library finds a
/// fault in it. \throw LimitError
bool decode_ijg(std::string_view stream, int bits, std::vector<char>& to);

}  // namespace marrow::internal::io
