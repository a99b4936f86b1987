// Checks what the JPEG streams of medical images claim, and has them decoded.
#include "grey_jpeg.h"

#include <marrow/error.h>

#include "ijg.h"

namespace marrow::internal::io {

namespace {

const InputError kDamaged("its JPEG pixels are damaged or truncated");

// Each scan of a progressive image processes all samples, even if it has few bytes. Ten scans are usual.
void check_scans(std::string_view stream) {
    using namespace std::string_view_literals;
    constexpr int kMost = 200;
    int scans = 0;
    for (std::size_t at = 0; (at = stream.find("\xff\xda"sv, at)) != stream.npos; at += 2) {
        if (++scans > kMost) throw kDamaged;
    }
}

struct FrameHeader {
    int bits;
    std::int64_t rows, columns;
    int components;
};

// Reads the frame header of a stream: ITU-T T.81, B.2.2.
FrameHeader frame_header(std::string_view stream) {
    const auto byte = [&](std::size_t at) {
        if (at >= stream.size()) throw kDamaged;
        return static_cast<int>(static_cast<unsigned char>(stream[at]));
    };
    const auto word = [&](std::size_t at) { return byte(at) << 8 | byte(at + 1); };
    if (word(0) != 0xffd8) throw kDamaged;
    for (std::size_t at = 2;;) {
        if (byte(at++) != 0xff) throw kDamaged;
        while (byte(at) == 0xff) ++at;
        const int marker = byte(at++);
        if (marker >= 0xc0 && marker <= 0xc3) return {byte(at + 2), word(at + 3), word(at + 5), byte(at + 7)};
        // Only tables and comments may come before the frame header.
        if (marker != 0xc4 && (marker < 0xdb || marker == 0xdc)) throw kDamaged;
        at += static_cast<std::size_t>(word(at));
    }
}

}  // namespace

DecodedFrame decode_grey_jpeg(std::string_view stream, std::int64_t columns, std::int64_t rows) {
    const FrameHeader frame = frame_header(stream);
    check_size(frame.columns, frame.rows, frame.components, frame.bits, columns, rows);
    check_scans(stream);
    DecodedFrame out{{}, frame.bits > 8 ? 2 : 1, frame.bits};
    out.cells.resize(static_cast<std::size_t>(columns * rows * out.cell_size));
    if (!decode_ijg(stream, frame.bits, out.cells)) throw kDamaged;
    return out;
}

}  // namespace marrow::internal::io
