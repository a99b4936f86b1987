// After ITU-T T.81; clauses and figures below are its.
#include "grey_jpeg.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <optional>

#include <marrow/error.h>

namespace marrow {

namespace {

[[noreturn]] void refuse(const char* why) {
    throw InputError(fmt::format("its JPEG pixels {}", why));
}
[[noreturn]] void refuse_damaged() {
    refuse("are damaged");
}
[[noreturn]] void refuse_truncated() {
    refuse("are truncated");
}

constexpr int block_size = 64;
using Block = std::array<std::int32_t, block_size>;

// Figure 5: where the n-th coefficient of a block stands.
constexpr std::array<std::uint8_t, block_size> zigzag = {
    0,  1,  8,  16, 9,  2,  3,  10, 17, 24, 32, 25, 18, 11, 4,  5,  12, 19, 26, 33, 40, 48,
    41, 34, 27, 20, 13, 6,  7,  14, 21, 28, 35, 42, 49, 56, 57, 50, 43, 36, 29, 22, 15, 23,
    30, 37, 44, 51, 58, 59, 52, 45, 38, 31, 39, 46, 53, 60, 61, 54, 47, 55, 62, 63};

// Wraps as the standard's arithmetic of fixed width does, so that hostile sums are defined.
std::int32_t sum(std::int32_t a, std::int32_t b) {
    return static_cast<std::int32_t>(static_cast<std::uint32_t>(a) + static_cast<std::uint32_t>(b));
}
std::int32_t shifted(std::int32_t value, int by) {
    return static_cast<std::int32_t>(static_cast<std::uint32_t>(value) << by);
}

// The bits between markers.
class BitReader {
  public:
    BitReader(std::string_view bytes, std::size_t at) : bytes_(bytes), at_(at) {}

    // The next 16 bits, zeros beyond the end, which only drop() notices.
    std::uint32_t peek16() {
        fill();
        return static_cast<std::uint32_t>(buffer_ >> 48);
    }
    void drop(int count) {
        if (count > held_) refuse_truncated();
        buffer_ <<= count;
        held_ -= count;
    }
    std::int32_t take(int count) {
        if (count == 0) return 0;
        const std::uint32_t bits = peek16() >> (16 - count);
        drop(count);
        return static_cast<std::int32_t>(bits);
    }
    // A number of `count` bits with its sign: EXTEND, figure F.12.
    std::int32_t take_signed(int count) {
        const std::int32_t value = take(count);
        return count > 0 && value < 1 << (count - 1) ? value - (1 << count) + 1 : value;
    }
    // Forgets what is left of a byte and goes on to the next marker; returns where it is.
    std::size_t to_marker() {
        buffer_ = 0;
        held_ = 0;
        while (at_ + 1 < bytes_.size() && !at_marker()) ++at_;
        return at_;
    }
    void expect_restart(int number) {
        to_marker();
        if (at_ + 1 >= bytes_.size()) refuse_truncated();
        if (static_cast<unsigned char>(bytes_[at_ + 1]) != 0xd0 + number) refuse_damaged();
        at_ += 2;
    }

  private:
    bool at_marker() const {
        return bytes_[at_] == '\xff' && bytes_[at_ + 1] != '\0' && bytes_[at_ + 1] != '\xff';
    }
    void fill() {
        while (held_ <= 48) {
            if (at_ >= bytes_.size() || (at_ + 1 < bytes_.size() && at_marker())) return;
            const auto byte = static_cast<unsigned char>(bytes_[at_++]);
            if (byte == 0xff) {  // a zero follows it that is no data
                if (at_ >= bytes_.size() || bytes_[at_] != '\0') return;
                ++at_;
            }
            buffer_ |= static_cast<std::uint64_t>(byte) << (56 - held_);
            held_ += 8;
        }
    }

    std::string_view bytes_;
    std::size_t at_;
    std::uint64_t buffer_ = 0;  // from the top
    int held_ = 0;
};

// Annex C: codes of each length count upwards.
class HuffmanTable {
  public:
    HuffmanTable(const std::array<std::uint8_t, 16>& counts, std::vector<std::uint8_t> values)
        : values_(std::move(values)) {
        std::uint32_t code = 0, index = 0;
        for (std::size_t i = 0; i < 16; ++i) {
            first_index_[i] = static_cast<std::int32_t>(index) - static_cast<std::int32_t>(code);
            code += counts[i];
            index += counts[i];
            if (code > 2u << i) refuse_damaged();
            limit_[i] = code << (15 - i);
            code <<= 1;
        }
    }

    std::uint8_t take(BitReader& in) const {
        const std::uint32_t bits = in.peek16();
        for (std::size_t i = 0; i < 16; ++i) {
            if (bits >= limit_[i]) continue;
            in.drop(static_cast<int>(i) + 1);
            return values_[static_cast<std::size_t>(first_index_[i] +
                                                    static_cast<std::int32_t>(bits >> (15 - i)))];
        }
        refuse_damaged();
    }

  private:
    std::vector<std::uint8_t> values_;
    std::array<std::uint32_t, 16> limit_{};       // codes of i + 1 bits, moved up to 16, are below
    std::array<std::int32_t, 16> first_index_{};  // what makes such a code an index into values_
};

struct Scan {
    int first = 0, last = 0;  // coefficients; first is the predictor of lossless
    int high = 0, low = 0;    // bits: successive approximation; low is the point transform of lossless
    const HuffmanTable *dc = nullptr, *ac = nullptr;
};

class Decoder {
  public:
    Decoder(std::string_view stream, std::int64_t columns, std::int64_t rows)
        : stream_(stream), columns_(columns), rows_(rows) {}

    GreyJpeg decode() {
        if (byte() != 0xff || byte() != 0xd8) refuse_damaged();
        for (int scans = 0;;) {
            const int marker = next_marker();
            if (marker == 0xd9) break;
            const std::size_t end = begin_segment();
            if (marker == 0xc4) {
                while (at_ < end) read_huffman_table();
            } else if (marker == 0xdb) {
                while (at_ < end) read_quantization();
            } else if (marker == 0xdd) {
                restart_interval_ = word();
            } else if (marker >= 0xc0 && marker <= 0xcf && marker != 0xc8 && marker != 0xcc) {
                read_frame(marker);
            } else if (marker == 0xda) {
                constexpr int most_scans = 200;  // a progressive picture has some ten
                if (++scans > most_scans) refuse_damaged();
                read_scan();
                continue;  // it ends where its bits do
            } else if (marker == 0xdc || marker == 0xcc) {
                refuse("are of a kind that is not read (late height, arithmetic coding)");
            }
            at_ = end;
        }
        if (!started_) refuse_damaged();
        if (!lossless_) transform();
        return {bits_, std::move(samples_)};
    }

  private:
    std::uint32_t byte() {
        if (at_ >= stream_.size()) refuse_truncated();
        return static_cast<unsigned char>(stream_[at_++]);
    }
    std::uint32_t word() {
        const std::uint32_t high = byte();
        return high << 8 | byte();
    }
    int next_marker() {
        if (byte() != 0xff) refuse_damaged();
        std::uint32_t marker = byte();
        while (marker == 0xff) marker = byte();
        return static_cast<int>(marker);
    }
    std::size_t begin_segment() {
        const std::size_t begin = at_;
        const std::uint32_t size = word();
        if (size < 2) refuse_damaged();
        if (stream_.size() - begin < size) refuse_truncated();
        return begin + size;
    }

    void read_huffman_table() {
        const std::uint32_t place = byte();
        if (place >> 4 > 1 || (place & 15) > 3) refuse_damaged();
        std::array<std::uint8_t, 16> counts;
        std::size_t total = 0;
        for (auto& count : counts) total += count = static_cast<std::uint8_t>(byte());
        std::vector<std::uint8_t> values(total);
        for (auto& value : values) value = static_cast<std::uint8_t>(byte());
        huffman_[place >> 4][place & 15].emplace(counts, std::move(values));
    }

    void read_quantization() {
        const std::uint32_t place = byte();
        if (place >> 4 > 1 || (place & 15) > 3) refuse_damaged();
        auto& table = quantization_[place & 15].emplace();
        for (const std::uint8_t to : zigzag)
            table[to] = static_cast<std::int32_t>(place >> 4 ? word() : byte());
    }

    void read_frame(int marker) {
        if (bits_ != 0 || marker > 0xc3) refuse("are of a kind that is not read (hierarchical or arithmetic)");
        lossless_ = marker == 0xc3;
        progressive_ = marker == 0xc2;
        bits_ = static_cast<int>(byte());
        const std::int64_t rows = word(), columns = word();
        const std::uint32_t components = byte();
        if (rows != rows_ || columns != columns_ || components != 1) {
            throw InputError(fmt::format(
                "its compressed pixels are {} x {} of {} components, its header says {} x {} of one", columns,
                rows, components, columns_, rows_));
        }
        if (lossless_ ? bits_ < 2 || bits_ > 16 : bits_ != 8 && bits_ != 12) refuse_damaged();
        byte();  // the component's name
        byte();  // its sampling, of no meaning where it is alone
        table_ = byte() & 3;
        blocks_across_ = (columns_ + 7) / 8;
        const std::int64_t units = lossless_ ? columns_ * rows_ : blocks_across_ * ((rows_ + 7) / 8);
        // each takes a bit at least: no memory for what cannot be there
        if (units / 8 > static_cast<std::int64_t>(stream_.size())) refuse_truncated();
        if (!lossless_) blocks_.resize(static_cast<std::size_t>(units));
        samples_.resize(static_cast<std::size_t>(columns_ * rows_));
    }

    void read_scan() {
        if (bits_ == 0 || byte() != 1) refuse_damaged();
        byte();  // the component's name
        const std::uint32_t tables = byte();
        Scan scan;
        scan.first = static_cast<int>(byte());
        scan.last = static_cast<int>(byte());
        const std::uint32_t approximation = byte();
        scan.high = static_cast<int>(approximation >> 4);
        scan.low = static_cast<int>(approximation & 15);
        const auto table = [&](std::size_t kind, std::uint32_t place) {
            return place < 4 && huffman_[kind][place] ? &*huffman_[kind][place] : nullptr;
        };
        scan.dc = table(0, tables >> 4);
        scan.ac = table(1, tables & 15);

        BitReader in(stream_, at_);
        if (lossless_) {
            if (!scan.dc || scan.first < 1 || scan.first > 7 || scan.low >= bits_) refuse_damaged();
            lossless_scan(in, scan);
        } else {
            if (!progressive_) scan.first = 0, scan.last = 63, scan.high = scan.low = 0;
            const bool with_dc = scan.first == 0, with_ac = scan.last > 0;
            if (scan.first > scan.last || scan.last > 63 || scan.low > 13 ||
                (with_dc && scan.high == 0 && !scan.dc) || (with_ac && !scan.ac) ||
                (progressive_ && with_dc && with_ac)) {
                refuse_damaged();
            }
            block_scan(in, scan);
        }
        started_ = true;
        at_ = in.to_marker();
    }

    // True where a new interval begins before the n-th unit.
    bool restarts(BitReader& in, std::int64_t n) const {
        if (restart_interval_ == 0 || n == 0 || n % restart_interval_ != 0) return false;
        in.expect_restart(static_cast<int>((n / restart_interval_ - 1) % 8));
        return true;
    }

    // Annex H.
    void lossless_scan(BitReader& in, const Scan& scan) {
        const auto width = static_cast<std::size_t>(columns_);
        if (restart_interval_ % columns_ != 0) refuse_damaged();
        const int start = bits_ > scan.low ? 1 << (bits_ - scan.low - 1) : 0;
        std::size_t top = 0;  // the row that has none above, after a restart too
        for (std::size_t row = 0; row < static_cast<std::size_t>(rows_); ++row) {
            if (restarts(in, static_cast<std::int64_t>(row * width))) top = row;
            std::uint16_t* x = samples_.data() + row * width;
            const std::uint16_t* above = row == top ? nullptr : x - width;
            for (std::size_t i = 0; i < width; ++i) {
                int predicted = 0;
                if (row == top) {
                    predicted = i == 0 ? start : x[i - 1];
                } else if (i == 0) {
                    predicted = above[0];
                } else {
                    const int a = x[i - 1], b = above[i], c = above[i - 1];
                    switch (scan.first) {  // table H.1
                        case 1: predicted = a; break;
                        case 2: predicted = b; break;
                        case 3: predicted = c; break;
                        case 4: predicted = a + b - c; break;
                        case 5: predicted = a + ((b - c) >> 1); break;
                        case 6: predicted = b + ((a - c) >> 1); break;
                        default: predicted = (a + b) / 2;
                    }
                }
                const int size = scan.dc->take(in);
                if (size > 16) refuse_damaged();
                const int difference = size == 16 ? 32768 : in.take_signed(size);
                x[i] = static_cast<std::uint16_t>(predicted + difference);
            }
        }
        for (auto& sample : samples_) sample = static_cast<std::uint16_t>(sample << scan.low);
    }

    void block_scan(BitReader& in, const Scan& scan) {
        std::int32_t dc = 0;
        std::int32_t end_run = 0;  // blocks to come that have no more new coefficients
        for (std::size_t n = 0; n < blocks_.size(); ++n) {
            if (restarts(in, static_cast<std::int64_t>(n))) dc = end_run = 0;
            Block& block = blocks_[n];
            if (scan.first == 0) {
                if (scan.high == 0) {
                    const int size = scan.dc->take(in);
                    if (size > 15) refuse_damaged();
                    dc = sum(dc, in.take_signed(size));
                    block[0] = shifted(dc, scan.low);
                } else if (in.take(1)) {
                    block[0] |= 1 << scan.low;
                }
            }
            if (scan.last == 0) continue;
            if (scan.high == 0)
                first_coefficients(in, scan, block, end_run);
            else
                refined_coefficients(in, scan, block, end_run);
        }
    }

    // Clauses F.2.2.2 and G.1.2.2; a sequential picture has no runs.
    static void first_coefficients(BitReader& in, const Scan& scan, Block& block, std::int32_t& end_run) {
        if (end_run > 0) {
            --end_run;
            return;
        }
        for (int k = std::max(scan.first, 1); k <= scan.last; ++k) {
            const int code = scan.ac->take(in), run = code >> 4, size = code & 15;
            if (size == 0) {
                if (run < 15) {
                    end_run = (1 << run) - 1 + in.take(run);
                    return;
                }
                k += 15;
                continue;
            }
            k += run;
            if (k > scan.last) refuse_damaged();
            block[zigzag[static_cast<std::size_t>(k)]] = shifted(in.take_signed(size), scan.low);
        }
    }

    // Clause G.1.2.3: a bit more of each coefficient that is there, and new ones between them.
    static void refined_coefficients(BitReader& in, const Scan& scan, Block& block, std::int32_t& end_run) {
        const std::int32_t bit = 1 << scan.low;
        const auto refine = [&](std::int32_t& c) {
            if (in.take(1) && (std::abs(c) & bit) == 0) c += c > 0 ? bit : -bit;
        };
        int k = scan.first;
        while (end_run == 0 && k <= scan.last) {
            const int code = scan.ac->take(in), size = code & 15;
            int run = code >> 4;
            std::int32_t value = 0;
            if (size == 0 && run < 15) {
                end_run = (1 << run) + in.take(run);
                break;
            }
            if (size > 1) refuse_damaged();
            if (size == 1) value = in.take(1) ? bit : -bit;
            for (;; ++k) {
                if (k > scan.last) {
                    if (size == 1) refuse_damaged();
                    break;
                }
                std::int32_t& c = block[zigzag[static_cast<std::size_t>(k)]];
                if (c != 0) {
                    refine(c);
                } else if (run-- == 0) {
                    c = value;
                    ++k;
                    break;
                }
            }
        }
        if (end_run == 0) return;
        for (; k <= scan.last; ++k) {
            std::int32_t& c = block[zigzag[static_cast<std::size_t>(k)]];
            if (c != 0) refine(c);
        }
        --end_run;
    }

    // Clause A.3.3, rows and then columns.
    void transform() {
        const auto& table = quantization_[table_];
        if (!table) refuse_damaged();
        static const auto cosines = [] {
            std::array<std::array<double, 8>, 8> out;  // [x][u]
            for (int x = 0; x < 8; ++x) {
                for (int u = 0; u < 8; ++u)
                    out[x][u] = (u == 0 ? std::sqrt(0.125) : 0.5) * std::cos((2 * x + 1) * u * M_PI / 16);
            }
            return out;
        }();
        const double middle = 1 << (bits_ - 1), most = (1 << bits_) - 1;
        for (std::size_t n = 0; n < blocks_.size(); ++n) {
            std::array<double, block_size> half;
            for (std::size_t v = 0; v < 8; ++v) {
                for (std::size_t x = 0; x < 8; ++x) {
                    double total = 0;
                    for (std::size_t u = 0; u < 8; ++u)
                        total += cosines[x][u] * blocks_[n][8 * v + u] * (*table)[8 * v + u];
                    half[8 * v + x] = total;
                }
            }
            const auto left = static_cast<std::int64_t>(n) % blocks_across_ * 8;
            const auto top = static_cast<std::int64_t>(n) / blocks_across_ * 8;
            for (std::int64_t y = 0; y < std::min<std::int64_t>(8, rows_ - top); ++y) {
                for (std::int64_t x = 0; x < std::min<std::int64_t>(8, columns_ - left); ++x) {
                    double total = middle;
                    for (std::int64_t v = 0; v < 8; ++v)
                        total += cosines[static_cast<std::size_t>(y)][static_cast<std::size_t>(v)] *
                                 half[static_cast<std::size_t>(8 * v + x)];
                    samples_[static_cast<std::size_t>((top + y) * columns_ + left + x)] =
                        static_cast<std::uint16_t>(std::clamp(std::round(total), 0.0, most));
                }
            }
        }
    }

    std::string_view stream_;
    std::int64_t columns_, rows_;
    std::size_t at_ = 0;
    bool lossless_ = false, progressive_ = false, started_ = false;
    int bits_ = 0;
    std::uint32_t table_ = 0;
    std::int64_t restart_interval_ = 0, blocks_across_ = 0;
    std::array<std::array<std::optional<HuffmanTable>, 4>, 2> huffman_;  // [DC, AC]
    std::array<std::optional<Block>, 4> quantization_;
    std::vector<Block> blocks_;  // coefficients, not in zigzag order
    std::vector<std::uint16_t> samples_;
};

}  // namespace

GreyJpeg decode_grey_jpeg(std::string_view stream, std::int64_t columns, std::int64_t rows) {
    return Decoder(stream, columns, rows).decode();
}

}  // namespace marrow
