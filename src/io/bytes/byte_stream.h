// The bytes of a file in order, inflated where they are compressed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

namespace marrow {

enum class Compression {
    none,
    zlib,     ///< gzip or zlib
    deflate,  ///< the same without header and checksum
};

/// Reads a file from front to back. Only regular files are opened.
class ByteStream {
  public:
    /// Opens `path` at `offset`. \throw IoError where it cannot be opened or is not a regular file.
    ByteStream(const std::filesystem::path& path, Compression compression, std::uint64_t offset = 0);
    ~ByteStream();
    ByteStream(const ByteStream&) = delete;
    ByteStream& operator=(const ByteStream&) = delete;

    /// Reads up to `size` bytes and returns how many there were. \throw IoError; InputError a damaged stream.
    std::size_t read_some(void* to, std::size_t size);
    /// Reads `size` bytes. \throw as read_some, and InputError where the file ends before.
    void read(void* to, std::size_t size);
    void skip(std::uint64_t size);
    /// Goes to `offset` in the file. \pre it is not compressed.
    void seek(std::uint64_t offset);
    /// Where little is left, reads on to the end of a compressed stream, whose checksum is then verified.
    void verify_end();

  private:
    struct State;
    std::unique_ptr<State> state_;
};

/// Size of a regular file. \throw IoError where it is missing or not a regular file.
std::uint64_t size_of_file(const std::filesystem::path& path);

/// The first bytes of a file, at most `size`.
std::string head_of(const std::filesystem::path& path, std::size_t size);

}  // namespace marrow
