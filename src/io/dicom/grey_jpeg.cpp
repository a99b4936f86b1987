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

// Iterates over the segments of a stream up to its first samples: ITU-T T.81, B.1.
class Segments {
  public:
    explicit Segments(std::string_view stream) : stream_(stream) {
        if (word(0) != 0xffd8) throw kDamaged;
    }

    // Moves on to the next segment and returns its marker. Then positions count from its length.
    int next() {
        at_ += length_;
        if (at(0) != 0xff) throw kDamaged;
        while (at(0) == 0xff) ++at_;
        const int marker = at(0);
        ++at_;
        length_ = static_cast<std::size_t>(word(at_));
        return marker;
    }
    int at(std::size_t position) const { return byte(at_ + position); }
    int word_at(std::size_t position) const { return word(at_ + position); }
    std::size_t offset() const { return at_; }

  private:
    int byte(std::size_t at) const {
        if (at >= stream_.size()) throw kDamaged;
        return static_cast<int>(static_cast<unsigned char>(stream_[at]));
    }
    int word(std::size_t at) const { return byte(at) << 8 | byte(at + 1); }

    std::string_view stream_;
    std::size_t at_ = 2, length_ = 0;
};

bool is_table_or_comment(int marker) {
    return marker == 0xc4 || (marker >= 0xdb && marker != 0xdc);
}

struct FrameHeader {
    int marker, bits;
    std::int64_t rows, columns;
    int components;
};

// Moves on to the frame header and reads it: B.2.2.
FrameHeader frame_header(Segments& segments) {
    for (;;) {
        const int marker = segments.next();
        if (marker >= 0xc0 && marker <= 0xc3)
            return {marker, segments.at(2), segments.word_at(3), segments.word_at(5), segments.at(7)};
        if (!is_table_or_comment(marker)) throw kDamaged;
    }
}

// Some encoders leave out the range of frequencies of a sequential scan, which is always the same: B.2.3.
// Decoders need not look at it, and libjpeg takes another one for damage.
std::string with_all_frequencies(std::string_view stream, Segments& segments) {
    for (int marker; (marker = segments.next()) != 0xda;) {
        if (!is_table_or_comment(marker)) throw kDamaged;
    }
    const auto range = static_cast<std::size_t>(3 + 2 * segments.at(2));
    if (segments.word_at(0) != static_cast<int>(range) + 3) throw kDamaged;
    const std::size_t at = segments.offset() + range;
    if (stream.size() < at + 3) throw kDamaged;
    std::string out(stream);
    out.replace(at, 3, std::string{0, 63, 0});
    return out;
}

}  // namespace

DecodedFrame decode_grey_jpeg(std::string_view stream, std::int64_t columns, std::int64_t rows) {
    Segments segments(stream);
    const FrameHeader frame = frame_header(segments);
    check_size(frame.columns, frame.rows, frame.components, frame.bits, columns, rows);
    check_scans(stream);
    DecodedFrame out{{}, frame.bits > 8 ? 2 : 1, frame.bits};
    out.cells.resize(static_cast<std::size_t>(columns * rows * out.cell_size));
    const bool sequential = frame.marker <= 0xc1;
    if (!decode_ijg(sequential ? with_all_frequencies(stream, segments) : stream, frame.bits, out.cells))
        throw kDamaged;
    return out;
}

}  // namespace marrow::internal::io
