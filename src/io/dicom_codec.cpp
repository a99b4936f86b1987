#include "dicom_codec.h"

#include <fmt/format.h>
#include <gdcmFragment.h>
#include <gdcmJPEG2000Codec.h>
#include <gdcmJPEGCodec.h>
#include <gdcmJPEGLSCodec.h>
#include <gdcmSequenceOfFragments.h>
#include <gdcmTrace.h>

#include <algorithm>
#include <array>
#include <memory>
#include <optional>

#include <marrow/error.h>

namespace marrow {

namespace {

// What a stream says of itself. GDCM's codecs trust it, so it is compared with the header first.
struct StreamInfo {
    std::int64_t columns = 0, rows = 0;
    int components = 0, bits = 0;
    bool lossy = false;  // JPEG by cosine transform
};

class Cursor {
  public:
    Cursor(std::string_view bytes, std::size_t at) : bytes_(bytes), at_(at) {}
    bool has(std::size_t count) const { return at_ <= bytes_.size() && bytes_.size() - at_ >= count; }
    std::uint32_t take(int size) {
        std::uint32_t out = 0;
        for (int i = 0; i < size; ++i) out = out << 8 | static_cast<unsigned char>(bytes_[at_++]);
        return out;
    }
    void skip(std::size_t count) { at_ += count; }

  private:
    std::string_view bytes_;
    std::size_t at_;
};

// The frame header of JPEG and JPEG-LS.
std::optional<StreamInfo> jpeg_info(std::string_view stream) {
    Cursor in(stream, 0);
    if (!in.has(2) || in.take(2) != 0xffd8) return {};
    while (in.has(4)) {
        std::uint32_t marker = in.take(2);
        while (marker == 0xffff && in.has(3)) marker = 0xff00 | in.take(1);  // fill bytes
        if (marker >> 8 != 0xff) return {};
        const std::uint32_t size = in.take(2);
        const std::uint32_t code = marker & 0xff;
        const bool is_frame =
            (code >= 0xc0 && code <= 0xcf && code != 0xc4 && code != 0xc8 && code != 0xcc) || code == 0xf7;
        if (size < 2) return {};
        if (is_frame) {
            if (!in.has(6)) return {};
            StreamInfo info;
            info.lossy = code != 0xc3 && code != 0xf7;
            info.bits = static_cast<int>(in.take(1));
            info.rows = in.take(2);
            info.columns = in.take(2);
            info.components = static_cast<int>(in.take(1));
            return info;
        }
        in.skip(size - 2);
    }
    return {};
}

// The SIZ segment of JPEG 2000, which comes first; the stream may be in a JP2 box.
std::optional<StreamInfo> jpeg2000_info(std::string_view stream) {
    using namespace std::string_view_literals;
    const std::size_t start = stream.find("\xff\x4f\xff\x51"sv);
    Cursor in(stream, start == stream.npos ? stream.size() : start + 4);
    if (!in.has(39)) return {};
    in.skip(4);
    StreamInfo info;
    const std::int64_t right = in.take(4), bottom = in.take(4), left = in.take(4), top = in.take(4);
    in.skip(16);
    info.columns = right - left;
    info.rows = bottom - top;
    info.components = static_cast<int>(in.take(2));
    info.bits = static_cast<int>(in.take(1) & 0x7f) + 1;
    return info;
}

// Run lengths (PackBits), one segment for each byte of a cell, the highest first: DICOM PS3.5 annex G.
std::vector<char> decode_run_lengths(std::string_view stream, std::size_t area, std::size_t cell_size) {
    constexpr std::size_t header_size = 64;
    const auto at = [&](std::size_t offset) {
        std::uint32_t out = 0;
        for (std::size_t i = 0; i < 4; ++i)
            out |= static_cast<std::uint32_t>(static_cast<unsigned char>(stream[offset + i])) << (8 * i);
        return out;
    };
    if (stream.size() < header_size || at(0) != cell_size)
        throw InputError("its run-length coded pixels are damaged");
    std::vector<char> cells(area * cell_size);
    for (std::size_t segment = 0; segment < cell_size; ++segment) {
        const std::size_t begin = at(4 + 4 * segment);
        const std::size_t end = segment + 1 < cell_size ? at(8 + 4 * segment) : stream.size();
        if (begin < header_size || end < begin || end > stream.size())
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

bool is_rle(const std::string& uid) {
    return uid == "1.2.840.10008.1.2.5";
}
bool is_jpeg2000(const std::string& uid) {
    return uid == "1.2.840.10008.1.2.4.90" || uid == "1.2.840.10008.1.2.4.91";
}

bool is_jpeg_ls(const std::string& uid) {
    return uid == "1.2.840.10008.1.2.4.80" || uid == "1.2.840.10008.1.2.4.81";
}

// GDCM writes its warnings to stderr; what matters becomes an exception here.
void silence_gdcm() {
    static const bool once = [] {
        gdcm::Trace::DebugOff();
        gdcm::Trace::WarningOff();
        gdcm::Trace::ErrorOff();
        return true;
    }();
    static_cast<void>(once);
}

}  // namespace

bool is_compressed_syntax(const std::string& uid) {
    static constexpr std::array known = {
        "1.2.840.10008.1.2.4.50", "1.2.840.10008.1.2.4.51", "1.2.840.10008.1.2.4.53",
        "1.2.840.10008.1.2.4.55", "1.2.840.10008.1.2.4.57", "1.2.840.10008.1.2.4.70",
        "1.2.840.10008.1.2.4.80", "1.2.840.10008.1.2.4.81", "1.2.840.10008.1.2.4.90",
        "1.2.840.10008.1.2.4.91", "1.2.840.10008.1.2.5"};
    return std::find(known.begin(), known.end(), uid) != known.end();
}

DecodedFrame decode_frame(const std::string& syntax_uid, std::string_view stream, std::int64_t columns,
                          std::int64_t rows, int bits_allocated, int bits_stored, bool is_signed) {
    silence_gdcm();
    DecodedFrame out;
    out.bits = bits_stored;
    out.cell_size = bits_allocated / 8;
    const std::size_t area = static_cast<std::size_t>(columns * rows);
    if (is_rle(syntax_uid)) {
        out.cells = decode_run_lengths(stream, area, static_cast<std::size_t>(out.cell_size));
        return out;
    }
    const auto info = is_jpeg2000(syntax_uid) ? jpeg2000_info(stream) : jpeg_info(stream);
    if (!info) throw InputError("its compressed pixels are damaged");
    if (info->columns != columns || info->rows != rows || info->components != 1) {
        throw InputError(
            fmt::format("its compressed pixels are {} x {} of {} components, its header says {} x {} of one",
                        info->columns, info->rows, info->components, columns, rows));
    }
    if (info->bits < 2 || info->bits > 16) {
        throw InputError(fmt::format("its compressed samples have {} bits; 2 to 16 are read", info->bits));
    }
    out.bits = info->bits;
    out.cell_size = info->bits <= 8 ? 1 : 2;

    std::unique_ptr<gdcm::ImageCodec> codec;
    if (is_jpeg2000(syntax_uid))
        codec = std::make_unique<gdcm::JPEG2000Codec>();
    else if (is_jpeg_ls(syntax_uid))
        codec = std::make_unique<gdcm::JPEGLSCodec>();
    else
        codec = std::make_unique<gdcm::JPEGCodec>();
    const std::array<unsigned, 3> dims{static_cast<unsigned>(columns), static_cast<unsigned>(rows), 1};
    codec->SetNumberOfDimensions(2);
    codec->SetDimensions(dims.data());
    codec->SetPlanarConfiguration(0);
    codec->SetPhotometricInterpretation(gdcm::PhotometricInterpretation::MONOCHROME2);
    // GDCM chooses between its JPEG libraries of 8, 12 and 16 bits by what is allocated; the last does not do
    // lossy.
    const auto bits = static_cast<unsigned short>(out.bits);
    const auto allocated = static_cast<unsigned short>(info->lossy && bits == 12 ? 12 : out.cell_size * 8);
    codec->SetPixelFormat(
        gdcm::PixelFormat(1, allocated, bits, static_cast<unsigned short>(bits - 1), is_signed ? 1 : 0));

    std::string even(stream);
    if (even.size() % 2 != 0) even += '\0';
    gdcm::Fragment fragment;
    fragment.SetByteValue(even.data(), static_cast<std::uint32_t>(even.size()));
    const auto fragments = gdcm::SequenceOfFragments::New();
    fragments->AddFragment(fragment);
    gdcm::DataElement compressed(gdcm::Tag(0x7fe0, 0x0010)), plain;
    compressed.SetValue(*fragments);
    bool good = false;
    try {
        good = codec->Decode(compressed, plain);
    } catch (const std::bad_alloc&) {
        throw LimitError("its pixels do not fit in memory");
    } catch (const std::exception&) {
    }
    const gdcm::ByteValue* value = good ? plain.GetByteValue() : nullptr;
    const std::size_t needed = area * static_cast<std::size_t>(out.cell_size);
    if (!value || value->GetLength() < needed) {
        throw InputError(fmt::format("its compressed pixels (transfer syntax {}) are damaged", syntax_uid));
    }
    out.cells.assign(value->GetPointer(), value->GetPointer() + needed);
    return out;
}

}  // namespace marrow
