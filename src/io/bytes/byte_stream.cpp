// Reads files through POSIX calls, and inflates them by zlib.
#include "byte_stream.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <vector>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <marrow/error.h>

#include "text.h"

namespace marrow::internal::io {

struct ByteStream::State {
    std::filesystem::path path;
    int descriptor = -1;
    std::uint64_t size = 0;
    bool compressed = false;
    bool ended = false;  // the compressed stream
    z_stream zip{};
    std::vector<unsigned char> input;

    ~State() {
        if (descriptor >= 0) ::close(descriptor);
        if (compressed) inflateEnd(&zip);
    }

    void seek(std::uint64_t offset, int from) const {
        if (::lseek(descriptor, static_cast<off_t>(offset), from) < 0)
            fail<IoError>(path, "cannot be read: {}", std::strerror(errno));
    }

    std::size_t read_file(void* to, std::size_t size) {
        std::size_t done = 0;
        while (done < size) {
            const ssize_t got = ::read(descriptor, static_cast<char*>(to) + done, size - done);
            if (got == 0) break;
            if (got > 0)
                done += static_cast<std::size_t>(got);
            else if (errno != EINTR)
                fail<IoError>(path, "cannot be read: {}", std::strerror(errno));
        }
        return done;
    }

    // False at the end of the file.
    bool refill() {
        if (zip.avail_in > 0) return true;
        zip.next_in = input.data();
        zip.avail_in = static_cast<uInt>(read_file(input.data(), input.size()));
        return zip.avail_in > 0;
    }

    std::size_t inflate_some(void* to, std::size_t size) {
        auto* out = static_cast<unsigned char*>(to);
        std::size_t done = 0;
        while (done < size && !ended) {
            if (!refill()) break;
            const std::size_t room = std::min<std::size_t>(size - done, 1u << 30);
            zip.next_out = out + done;
            zip.avail_out = static_cast<uInt>(room);
            const int result = inflate(&zip, Z_NO_FLUSH);
            done += room - zip.avail_out;
            if (result == Z_STREAM_END) {
                // A gzip file may consist of several streams.
                if (refill() && zip.next_in[0] == 0x1f)
                    inflateReset(&zip);
                else
                    ended = true;
            } else if (result != Z_OK && result != Z_BUF_ERROR) {
                fail<InputError>(path, "its compressed data are damaged");
            }
        }
        return done;
    }
};

std::uint64_t regular_file_size(const std::filesystem::path& path) {
    std::error_code error;
    const auto status = std::filesystem::status(path, error);
    if (status.type() == std::filesystem::file_type::not_found) {
        fail<IoError>(path, "there is no such file");
    }
    if (error) fail<IoError>(path, "cannot be read: {}", error.message());
    if (!std::filesystem::is_regular_file(status)) {
        fail<IoError>(path, "is not a regular file");
    }
    const std::uint64_t size = std::filesystem::file_size(path, error);
    if (error) fail<IoError>(path, "cannot be read: {}", error.message());
    return size;
}

ByteStream::ByteStream(const std::filesystem::path& path, Compression compression, std::uint64_t offset)
    : state_(std::make_unique<State>()) {
    state_->path = path;
    // With O_NONBLOCK, opening a pipe does not wait for its writer.
    state_->descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    struct stat status {};
    if (state_->descriptor < 0 || ::fstat(state_->descriptor, &status) != 0) {
        fail<IoError>(path, "cannot be opened: {}", std::strerror(errno));
    }
    if (!S_ISREG(status.st_mode)) fail<IoError>(path, "is not a regular file");
    state_->size = static_cast<std::uint64_t>(status.st_size);
    if (offset > 0) seek(offset);
    if (compression != Compression::none) {
        const int window_bits = compression == Compression::deflate ? -15 : 15 + 32;  // 32: gzip or zlib
        if (inflateInit2(&state_->zip, window_bits) != Z_OK) throw LimitError("not enough memory for zlib");
        state_->compressed = true;
        state_->input.resize(1 << 16);
    }
}

ByteStream::~ByteStream() = default;

std::uint64_t ByteStream::file_size() const {
    return state_->size;
}

std::size_t ByteStream::read_some(void* to, std::size_t size) {
    return state_->compressed ? state_->inflate_some(to, size) : state_->read_file(to, size);
}

void ByteStream::read(void* to, std::size_t size) {
    if (read_some(to, size) != size) {
        fail<InputError>(state_->path, "ends before its last sample; the file is truncated");
    }
}

void ByteStream::skip(std::uint64_t size, const std::function<void(std::size_t)>& passed) {
    if (!state_->compressed) return state_->seek(size, SEEK_CUR);
    std::vector<char> bin(static_cast<std::size_t>(std::min<std::uint64_t>(size, std::uint64_t{1} << 20)));
    while (size > 0) {
        const auto part = static_cast<std::size_t>(std::min<std::uint64_t>(size, bin.size()));
        read(bin.data(), part);
        size -= part;
        passed(part);
    }
}

void ByteStream::seek(std::uint64_t offset) {
    state_->seek(offset, SEEK_SET);
}

void ByteStream::verify_end() {
    if (!state_->compressed) return;
    std::array<char, 4096> bin;
    for (int block = 0; block < 256 && !state_->ended; ++block) {
        if (read_some(bin.data(), bin.size()) < bin.size() && !state_->ended) {
            fail<InputError>(state_->path, "its compressed data end too early; the file is truncated");
        }
    }
}

std::string read_head(const std::filesystem::path& path, std::size_t size) {
    std::string head(static_cast<std::size_t>(std::min<std::uint64_t>(size, regular_file_size(path))), '\0');
    ByteStream stream(path, Compression::none);
    head.resize(stream.read_some(head.data(), head.size()));
    return head;
}

}  // namespace marrow::internal::io
