// Decodes JPEG by DCMTK.
#include "ijg.h"

#define HAVE_CONFIG_H  // required by DCMTK's headers
#include <dcmtk/config/osconfig.h>

#include <dcmtk/dcmjpeg/djcparam.h>
#include <dcmtk/dcmjpeg/djdijg12.h>
#include <dcmtk/dcmjpeg/djdijg16.h>
#include <dcmtk/dcmjpeg/djdijg8.h>

#include <marrow/error.h>

namespace marrow::internal::io {

namespace {

// DCMTK completes damaged images and warns. Here a warning is an error.
template <class Base>
struct Strict : Base {
    using Base::Base;
    void emitMessage(int level) const override {
        if (level < 0) warned = true;
    }
    mutable bool warned = false;
};

template <class Base>
bool decode(std::string_view stream, std::vector<char>& to) {
    static const DJCodecParameter parameters(ECC_lossyYCbCr, EDC_never, EUC_never, EPC_default);
    Strict<Base> decoder(parameters, false);
    if (decoder.init().bad()) throw LimitError("not enough memory for DCMTK");
    auto* from = reinterpret_cast<Uint8*>(const_cast<char*>(stream.data()));  // DCMTK only reads it
    const OFCondition result =
        decoder.decode(from, static_cast<Uint32>(stream.size()), reinterpret_cast<Uint8*>(to.data()),
                       static_cast<Uint32>(to.size()), false);
    return result.good() && !decoder.warned;
}

}  // namespace

bool decode_ijg(std::string_view stream, int bits, std::vector<char>& to) {
    if (bits > 12) return decode<DJDecompressIJG16Bit>(stream, to);
    if (bits > 8) return decode<DJDecompressIJG12Bit>(stream, to);
    return decode<DJDecompressIJG8Bit>(stream, to);
}

}  // namespace marrow::internal::io
