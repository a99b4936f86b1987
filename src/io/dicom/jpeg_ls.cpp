// Decodes JPEG-LS by CharLS.
#include "jpeg_ls.h"

#include <charls/charls.h>
#include <fmt/format.h>

#include <string>

#include <marrow/error.h>

namespace marrow::internal::io {

DecodedFrame decode_jpeg_ls(std::string_view stream, std::int64_t columns, std::int64_t rows) {
    // Without an end marker, CharLS 2.4 reads up to 2^31 missing bits of a truncated stream.
    const std::string bounded = std::string(stream) + "\xff\xd9";
    try {
        charls::jpegls_decoder decoder(bounded, true);
        const charls::frame_info& info = decoder.frame_info();
        check_size(info.width, info.height, info.component_count, info.bits_per_sample, columns, rows);
        DecodedFrame out{{}, info.bits_per_sample <= 8 ? 1 : 2, info.bits_per_sample};
        out.cells.resize(decoder.destination_size());
        decoder.decode(out.cells.data(), out.cells.size());
        return out;
    } catch (const charls::jpegls_error& error) {
        throw InputError(fmt::format("its JPEG-LS pixels are damaged or truncated ({})", error.what()));
    }
}

}  // namespace marrow::internal::io
