// Decodes JPEG, as DCMTK does.
#include "io/dicom/ijg.h"

extern "C" {
int marrow_decode_ijg8(const char* stream, std::size_t size, char* to, std::size_t to_size);
int marrow_decode_ijg12(const char* stream, std::size_t size, char* to, std::size_t to_size);
int marrow_decode_ijg16(const char* stream, std::size_t size, char* to, std::size_t to_size);
}

namespace marrow::internal::io {

bool decode_ijg(std::string_view stream, int bits, std::vector<char>& to) {
    const auto decode = bits > 12 ? marrow_decode_ijg16 : bits > 8 ? marrow_decode_ijg12 : marrow_decode_ijg8;
    return decode(stream.data(), stream.size(), to.data(), to.size()) != 0;
}

}  // namespace marrow::internal::io
