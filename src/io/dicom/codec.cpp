// Decodes compressed DICOM frames, and checks what their streams claim before a library sees them.
#include "codec.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include <marrow/error.h>

#include "base/checked_size.h"
#include "data_set.h"
#include "grey_jpeg.h"
#include "jpeg2000.h"
#include "jpeg_ls.h"

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

constexpr const char* kRunLengths = "1.2.840.10008.1.2.5";
constexpr std::array kJpeg = {"1.2.840.10008.1.2.4.50", "1.2.840.10008.1.2.4.51", "1.2.840.10008.1.2.4.53",
                              "1.2.840.10008.1.2.4.55", "1.2.840.10008.1.2.4.57", "1.2.840.10008.1.2.4.70"};
constexpr std::array kLossless = {kRunLengths,
                                  "1.2.840.10008.1.2.4.57",
                                  "1.2.840.10008.1.2.4.70",
                                  "1.2.840.10008.1.2.4.80",
                                  "1.2.840.10008.1.2.4.90",
                                  "1.2.840.10008.1.2.4.201",
                                  "1.2.840.10008.1.2.4.202"};
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

bool is_lossless(const std::string& uid) {
    return is_one_of(kLossless, uid);
}

DecodedFrame decode_frame(const std::string& syntax_uid, std::string_view stream, std::int64_t columns,
                          std::int64_t rows, int bits_allocated, int bits_stored) {
    checked_size(static_cast<std::uint64_t>(columns * rows), sizeof(std::int32_t));
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
