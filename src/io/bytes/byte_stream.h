/// Reads files from front to back, and decompresses them on the way.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

namespace marrow::internal::io {

enum class Compression {
    none,
    zlib,     ///< gzip or zlib
    deflate,  ///< without a header and checksum
};

/// A regular file that is read from front to back.
class ByteStream {
  public:
    /// Opens a file at an offset. \throw IoError it cannot be opened or is not a regular file
    ByteStream(const std::filesystem::path& path, Compression compression, std::uint64_t offset = 0);
    ~ByteStream();
    ByteStream(const ByteStream&) = delete;
    ByteStream& operator=(const ByteStream&) = delete;

    /// The size of the whole file.
    std::uint64_t file_size() const;
    /// Reads up to `size` bytes and returns their number; it is less only at the end.
    /// \throw IoError; InputError the compressed data are damaged
    std::size_t read_some(void* to, std::size_t size);
    /// Reads `size` bytes. \throw the errors of read_some; InputError the file ends early
    void read(void* to, std::size_t size);
    /// Skips bytes. Compressed ones are read in pieces, with a call of passed(bytes) after each. \throw the
    /// errors of read_some and passed(); InputError compressed data end early
    void skip(std::uint64_t size, const std::function<void(std::size_t)>& passed);
    /// Continues at an offset of the file. \pre it is not compressed
    void seek(std::uint64_t offset);
    /// Reads to the end of a compressed stream, if that is near, which verifies its checksum.
    void verify_end();

  private:
    struct State;
    std::unique_ptr<State> state_;
};

/// The size of a regular file. \throw IoError it is missing or not a regular file
std::uint64_t regular_file_size(const std::filesystem::path& path);

/// The first bytes of a file, at most `size`. \throw IoError
std::string read_head(const std::filesystem::path& path, std::size_t size);

}  // namespace marrow::internal::io
