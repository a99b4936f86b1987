// Decodes JPEG 2000 by OpenJPEG, and checks what its streams claim first.
#include "jpeg2000.h"

#include <fmt/format.h>
#include <openjpeg.h>

#include <algorithm>
#include <cstring>
#include <memory>

#include <marrow/error.h>

#include "data_set.h"

namespace marrow::internal::io {
namespace {

// A stream in memory for OpenJPEG.
struct Memory {
    std::string_view bytes;
    std::size_t at = 0;

    static OPJ_SIZE_T read(void* to, OPJ_SIZE_T size, void* self) {
        auto& m = *static_cast<Memory*>(self);
        const std::size_t count = std::min<std::size_t>(size, m.bytes.size() - m.at);
        if (count == 0) return static_cast<OPJ_SIZE_T>(-1);
        std::memcpy(to, m.bytes.data() + m.at, count);
        m.at += count;
        return count;
    }
    static OPJ_OFF_T skip(OPJ_OFF_T size, void* self) {
        auto& m = *static_cast<Memory*>(self);
        if (size < 0 || static_cast<std::size_t>(size) > m.bytes.size() - m.at) return -1;
        m.at += static_cast<std::size_t>(size);
        return size;
    }
    static OPJ_BOOL seek(OPJ_OFF_T to, void* self) {
        auto& m = *static_cast<Memory*>(self);
        if (to < 0 || static_cast<std::size_t>(to) > m.bytes.size()) return OPJ_FALSE;
        m.at = static_cast<std::size_t>(to);
        return OPJ_TRUE;
    }
};

// OpenJPEG spends time and memory on the claims of the SIZ marker (ITU-T T.800 A.5.1), so they are checked
// first.
void check_jpeg2000_start(std::string_view stream, std::int64_t columns, std::int64_t rows) {
    constexpr std::size_t kSizSize = 42;
    if (stream.size() < kSizSize) throw InputError("its JPEG 2000 pixels are truncated");
    const auto at = [&](std::size_t offset, std::size_t size) -> std::int64_t {
        return number_at(stream, offset, size, true);
    };
    const std::int64_t width = at(8, 4) - at(16, 4), height = at(12, 4) - at(20, 4);
    check_size(width, height, at(40, 2), 8, columns, rows);
    // Tiles of 32 x 32 are rare already.
    const std::int64_t tile = std::min(at(24, 4), width) * std::min(at(28, 4), height);
    if (tile < std::min<std::int64_t>(32 * 32, width * height))
        throw InputError("its JPEG 2000 pixels have implausibly small tiles");
}

// Whether a stream asks for high-throughput coding in a COD or COC marker (ITU-T T.800 A.6.1, A.6.2). They
// may be in the header of any tile, so they are looked for everywhere; other data hardly ever look like them.
bool is_high_throughput(std::string_view stream) {
    const auto at = [&](std::size_t offset) {
        return offset < stream.size() ? static_cast<unsigned char>(stream[offset]) : 0u;
    };
    for (std::size_t i = 0; (i = stream.find('\xff', i)) != stream.npos; ++i) {
        const bool cod = at(i + 1) == 0x52, coc = at(i + 1) == 0x53;
        if (!cod && !coc) continue;
        const std::size_t style = i + (cod ? 4 : 5), blocks = i + (cod ? 9 : 6);
        const unsigned levels = at(blocks), precincts = at(style) & 1 ? levels + 1 : 0;
        if ((at(i + 2) << 8 | at(i + 3)) == (cod ? 12 : 9) + precincts && levels <= 32 &&
            at(blocks + 1) + at(blocks + 2) <= 8 && at(blocks + 3) & 0x40 && at(blocks + 4) <= 1)
            return true;
    }
    return false;
}

}  // namespace

bool decodes_high_throughput() {
    return std::string_view(opj_version()) != "2.5.0";  // the oldest version that can be linked
}

DecodedFrame decode_jpeg2000(std::string_view stream, std::int64_t columns, std::int64_t rows) {
    using namespace std::string_view_literals;
    const InputError damaged("its JPEG 2000 pixels are damaged or truncated");
    // Some files wrap the stream in the boxes of JP2, which are not needed.
    const std::size_t start = stream.find("\xff\x4f\xff\x51"sv);
    if (start == stream.npos) throw damaged;
    stream.remove_prefix(start);
    check_jpeg2000_start(stream, columns, rows);
    if (!decodes_high_throughput() && is_high_throughput(stream))
        throw InputError(fmt::format(
            "its pixels are high-throughput JPEG 2000, which needs OpenJPEG 2.5.1, not {}", opj_version()));
    Memory memory{stream};
    const std::unique_ptr<opj_codec_t, void (*)(opj_codec_t*)> codec(opj_create_decompress(OPJ_CODEC_J2K),
                                                                     opj_destroy_codec);
    const std::unique_ptr<opj_stream_t, void (*)(opj_stream_t*)> source(opj_stream_default_create(OPJ_TRUE),
                                                                        opj_stream_destroy);
    if (!codec || !source) throw LimitError("not enough memory for OpenJPEG");
    opj_stream_set_user_data(source.get(), &memory, nullptr);
    opj_stream_set_user_data_length(source.get(), stream.size());
    opj_stream_set_read_function(source.get(), Memory::read);
    opj_stream_set_skip_function(source.get(), Memory::skip);
    opj_stream_set_seek_function(source.get(), Memory::seek);
    opj_dparameters_t parameters;
    opj_set_default_decoder_parameters(&parameters);
    opj_image_t* made = nullptr;
    if (!opj_setup_decoder(codec.get(), &parameters) || !opj_decoder_set_strict_mode(codec.get(), OPJ_TRUE) ||
        !opj_read_header(source.get(), codec.get(), &made)) {
        opj_image_destroy(made);
        throw damaged;
    }
    const std::unique_ptr<opj_image_t, void (*)(opj_image_t*)> image(made, opj_image_destroy);
    const auto size = [&] {
        const opj_image_comp_t& c = image->comps[0];
        check_size(c.w, c.h, image->numcomps, static_cast<int>(c.prec), columns, rows);
    };
    if (image->numcomps < 1) throw damaged;
    size();
    if (!opj_decode(codec.get(), source.get(), image.get()) || !opj_end_decompress(codec.get(), source.get()))
        throw damaged;
    size();
    const opj_image_comp_t& component = image->comps[0];
    if (!component.data) throw damaged;
    const std::size_t area = static_cast<std::size_t>(columns * rows);
    DecodedFrame out{std::vector<char>(area * 2), 2, static_cast<int>(component.prec)};
    for (std::size_t i = 0; i < area; ++i) {
        const auto cell = static_cast<std::uint16_t>(component.data[i]);
        std::memcpy(out.cells.data() + 2 * i, &cell, 2);
    }
    return out;
}

}  // namespace marrow::internal::io
