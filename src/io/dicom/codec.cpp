// Decodes compressed DICOM frames, and checks what their streams claim before a library sees them.
#include "codec.h"

#include <fmt/format.h>

#include <charls/charls.h>
#include <openjpeg.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>

#include <marrow/error.h>

#include "data_set.h"
#include "grey_jpeg.h"

namespace marrow::internal::io {

void check_size(std::int64_t columns, std::int64_t rows, std::int64_t components, int bits,
                std::int64_t wanted_columns, std::int64_t wanted_rows) {
    if (columns != wanted_columns || rows != wanted_rows || components != 1) {
        throw InputError(
            fmt::format("its compressed pixels are {} x {} of {} components, its header says {} x {} of one",
                        columns, rows, components, wanted_columns, wanted_rows));
    }
    if (bits < 2 || bits > 16)
        throw InputError(fmt::format("its compressed samples have {} bits; 2 to 16 are read", bits));
}

namespace {

// Decodes run lengths (PackBits) after DICOM PS3.5 annex G: one segment for each byte of a cell, the highest
// first.
std::vector<char> decode_run_lengths(std::string_view stream, std::size_t area, std::size_t cell_size) {
    constexpr std::size_t kHeaderSize = 64;
    const auto at = [&](std::size_t offset) { return number_at(stream, offset, 4, false); };
    if (stream.size() < kHeaderSize || at(0) != cell_size)
        throw InputError("its run-length coded pixels are damaged");
    std::vector<char> cells(area * cell_size);
    for (std::size_t segment = 0; segment < cell_size; ++segment) {
        const std::size_t begin = at(4 + 4 * segment);
        const std::size_t end = segment + 1 < cell_size ? at(8 + 4 * segment) : stream.size();
        if (begin < kHeaderSize || end < begin || end > stream.size())
            throw InputError("its run-length coded pixels are damaged");
        const std::string_view runs = stream.substr(begin, end - begin);
        std::size_t done = 0, i = 0;
        const auto put = [&](char byte) { cells[done++ * cell_size + (cell_size - 1 - segment)] = byte; };
        while (done < area && i < runs.size()) {
            const int code = static_cast<signed char>(runs[i++]);
            if (code == -128) continue;
            const std::size_t count = std::min<std::size_t>(code < 0 ? 1 - code : code + 1, area - done);
            const std::size_t bytes = code < 0 ? 1 : count;
            if (runs.size() - i < bytes) break;
            for (std::size_t j = 0; j < count; ++j) put(runs[code < 0 ? i : i + j]);
            i += bytes;
        }
        if (done < area) throw InputError("its run-length coded pixels are truncated");
    }
    return cells;
}

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

// Whether the linked OpenJPEG decodes the high-throughput form of JPEG 2000 (ITU-T T.814). Before 2.5.1, damaged
// streams of that form end the process by an assertion, or write beyond a buffer.
bool decodes_high_throughput() {
    return std::string_view(opj_version()) != "2.5.0";  // the oldest version that can be linked
}

// Whether a stream asks for high-throughput coding in a COD or COC marker (ITU-T T.800 A.6.1, A.6.2). They may be
// in the header of any tile, so they are looked for everywhere; other data hardly ever look like them.
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

constexpr const char* kRunLengths = "1.2.840.10008.1.2.5";
constexpr std::array kJpeg = {"1.2.840.10008.1.2.4.50", "1.2.840.10008.1.2.4.51", "1.2.840.10008.1.2.4.53",
                              "1.2.840.10008.1.2.4.55", "1.2.840.10008.1.2.4.57", "1.2.840.10008.1.2.4.70"};
constexpr std::array kJpegLs = {"1.2.840.10008.1.2.4.80", "1.2.840.10008.1.2.4.81"};
constexpr std::array kJpeg2000 = {"1.2.840.10008.1.2.4.90", "1.2.840.10008.1.2.4.91"};
constexpr std::array kHighThroughput = {"1.2.840.10008.1.2.4.201", "1.2.840.10008.1.2.4.202",
                                        "1.2.840.10008.1.2.4.203"};

template <class Uids>
bool is_one_of(const Uids& uids, const std::string& uid) {
    return std::find(uids.begin(), uids.end(), uid) != uids.end();
}

bool is_jpeg2000(const std::string& uid) {
    return is_one_of(kJpeg2000, uid) || (decodes_high_throughput() && is_one_of(kHighThroughput, uid));
}

}  // namespace

double most_inflation(const std::string& uid) {
    if (uid == kRunLengths) return 64;                              // 128 equal bytes become two
    if (is_one_of(kJpeg, uid)) return 1024;                         // one bit for a block of 64 samples
    if (is_one_of(kJpegLs, uid) || is_jpeg2000(uid)) return 20000;  // an empty slice takes almost no bytes
    return 0;
}

DecodedFrame decode_frame(const std::string& syntax_uid, std::string_view stream, std::int64_t columns,
                          std::int64_t rows, int bits_allocated, int bits_stored) {
    try {
        if (is_one_of(kJpeg, syntax_uid)) return decode_grey_jpeg(stream, columns, rows);
        if (is_one_of(kJpegLs, syntax_uid)) return decode_jpeg_ls(stream, columns, rows);
        if (is_jpeg2000(syntax_uid)) return decode_jpeg2000(stream, columns, rows);
    } catch (const std::bad_alloc&) {
        throw LimitError("its pixels do not fit in memory");
    }
    const std::size_t cell_size = static_cast<std::size_t>(bits_allocated) / 8;
    const std::size_t area = static_cast<std::size_t>(columns * rows);
    return {decode_run_lengths(stream, area, cell_size), static_cast<int>(cell_size), bits_stored};
}

}  // namespace marrow::internal::io
