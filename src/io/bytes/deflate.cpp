// Compresses output by zlib, and writes ZIP archives.
#include "deflate.h"

#include <algorithm>
#include <limits>

#include <zlib.h>

#include <marrow/error.h>

namespace marrow::internal::io {
namespace {

// Higher levels hardly compress meshes better but take several times as long.
constexpr int kLevel = 3;

void append(std::string& text, std::uint64_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) text += static_cast<char>(value >> (8 * i) & 0xff);
}

}  // namespace

struct Deflater::State {
    Write write;
    z_stream stream{};
    std::uint64_t written = 0;
    std::vector<unsigned char> out = std::vector<unsigned char>(std::size_t{1} << 18);

    void run(const void* data, std::size_t bytes, int flush) {
        stream.next_in = const_cast<Bytef*>(static_cast<const Bytef*>(data));
        stream.avail_in = static_cast<uInt>(bytes);
        int result = Z_OK;
        do {
            stream.next_out = out.data();
            stream.avail_out = static_cast<uInt>(out.size());
            result = deflate(&stream, flush);
            const std::size_t made = out.size() - stream.avail_out;
            write(out.data(), made);
            written += made;
        } while (flush == Z_FINISH ? result != Z_STREAM_END : stream.avail_out == 0);
    }
};

Deflater::Deflater(Wrapping wrapping, Write write) : state_(std::make_unique<State>()) {
    state_->write = std::move(write);
    constexpr int kWindow = 15, kGzip = 16, kMemory = 8;
    const int window = wrapping == Wrapping::gzip ? kWindow + kGzip : -kWindow;
    if (deflateInit2(&state_->stream, kLevel, Z_DEFLATED, window, kMemory, Z_DEFAULT_STRATEGY) != Z_OK)
        throw LimitError("not enough memory for zlib");
}

Deflater::~Deflater() {
    deflateEnd(&state_->stream);
}

void Deflater::write(const void* data, std::size_t bytes) {
    constexpr std::size_t kMost = std::numeric_limits<uInt>::max();
    const auto* next = static_cast<const unsigned char*>(data);
    while (bytes > 0) {
        const std::size_t piece = std::min(bytes, kMost);
        state_->run(next, piece, Z_NO_FLUSH);
        next += piece;
        bytes -= piece;
    }
}

void Deflater::finish() {
    state_->run(nullptr, 0, Z_FINISH);
}

std::uint64_t Deflater::written() const {
    return state_->written;
}

// The header before a file's bytes, or the longer one in the central directory.
std::string ZipWriter::header_of(const Entry& entry, bool central) const {
    constexpr int kDeflated = 8, kVersion = 20, kFirstDay = 1 << 5 | 1;  // 1980-01-01
    std::string text = central ? "PK\1\2" : "PK\3\4";
    if (central) append(text, kVersion, 2);
    append(text, kVersion, 2);
    append(text, 0, 2);  // flags
    append(text, kDeflated, 2);
    append(text, 0, 2);  // midnight
    append(text, kFirstDay, 2);
    append(text, entry.checksum, 4);
    append(text, entry.compressed_size, 4);
    append(text, entry.size, 4);
    append(text, entry.name.size(), 2);
    append(text, 0, 2);                             // extra fields
    if (central) text.append(2 + 2 + 2 + 4, '\0');  // comment, disk, attributes
    if (central) append(text, entry.offset, 4);
    return text + entry.name;
}

void ZipWriter::begin(const std::string& name) {
    end_entry();
    entries_.push_back({name, end_});
    const std::string header = header_of(entries_.back(), false);  // end_entry() overwrites it with the sizes
    file_.write(header);
    end_ += header.size();
    deflater_ = std::make_unique<Deflater>(
        Deflater::Wrapping::none, [this](const void* data, std::size_t bytes) { file_.write(data, bytes); });
}

void ZipWriter::write(const void* data, std::size_t bytes) {
    Entry& entry = entries_.back();
    entry.checksum =
        static_cast<std::uint32_t>(crc32_z(entry.checksum, static_cast<const Bytef*>(data), bytes));
    entry.size += bytes;
    if (entry.size > std::numeric_limits<std::uint32_t>::max())
        throw LimitError(
            "a 3MF file holds at most 4 GiB of text, and these surfaces need more; write .ply or .vtp");
    deflater_->write(data, bytes);
}

void ZipWriter::end_entry() {
    if (!deflater_) return;
    deflater_->finish();
    Entry& entry = entries_.back();
    entry.compressed_size = deflater_->written();
    deflater_.reset();
    end_ += entry.compressed_size;
    file_.seek(entry.offset);
    file_.write(header_of(entry, false));
    file_.seek(end_);
}

void ZipWriter::finish() {
    end_entry();
    std::string directory;
    for (const Entry& entry : entries_) directory += header_of(entry, true);
    std::string end = "PK\5\6";
    append(end, 0, 2 + 2);  // number of this disk and of the directory's
    append(end, entries_.size(), 2);
    append(end, entries_.size(), 2);
    append(end, directory.size(), 4);
    append(end, end_, 4);
    append(end, 0, 2);  // comment
    file_.write(directory + end);
}

}  // namespace marrow::internal::io
