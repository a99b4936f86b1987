// Compresses output by gzip.
#include "gzip_writer.h"

#include <algorithm>
#include <limits>

#include <zlib.h>

#include <marrow/error.h>

namespace marrow::internal::io {
namespace {

// As in zip_writer.cpp: higher levels hardly compress meshes better but take several times as long.
constexpr int kLevel = 3;

}  // namespace

struct GzipWriter::State {
    Write write;
    z_stream stream{};
    std::vector<unsigned char> out = std::vector<unsigned char>(std::size_t{1} << 18);

    void run(const void* data, std::size_t bytes, int flush) {
        stream.next_in = const_cast<Bytef*>(static_cast<const Bytef*>(data));
        stream.avail_in = static_cast<uInt>(bytes);
        int result = Z_OK;
        do {
            stream.next_out = out.data();
            stream.avail_out = static_cast<uInt>(out.size());
            result = deflate(&stream, flush);
            write(out.data(), out.size() - stream.avail_out);
        } while (flush == Z_FINISH ? result != Z_STREAM_END : stream.avail_out == 0);
    }
};

GzipWriter::GzipWriter(Write write) : state_(std::make_unique<State>()) {
    state_->write = std::move(write);
    constexpr int kWindow = 15, kGzip = 16, kMemory = 8;
    if (deflateInit2(&state_->stream, kLevel, Z_DEFLATED, kWindow + kGzip, kMemory, Z_DEFAULT_STRATEGY) !=
        Z_OK)
        throw LimitError("not enough memory for zlib");
}

GzipWriter::~GzipWriter() {
    deflateEnd(&state_->stream);
}

void GzipWriter::write(const void* data, std::size_t bytes) {
    constexpr std::size_t kMost = std::numeric_limits<uInt>::max();
    const auto* next = static_cast<const unsigned char*>(data);
    while (bytes > 0) {
        const std::size_t piece = std::min(bytes, kMost);
        state_->run(next, piece, Z_NO_FLUSH);
        next += piece;
        bytes -= piece;
    }
}

void GzipWriter::finish() {
    state_->run(nullptr, 0, Z_FINISH);
}

}  // namespace marrow::internal::io
