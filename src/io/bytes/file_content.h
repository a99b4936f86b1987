/// A file read into memory, which knows its path for error messages.
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <string>

#include "byte_stream.h"

namespace marrow::internal::io {

struct FileContent {
    std::filesystem::path path;
    std::string bytes;

    /// \throw InputError "<path>: <why>"
    [[noreturn]] void refuse(const std::string& why) const;
};

/// How many bytes a compressed mesh may expand to. Meshes become 3 to 10 times as long, and hardly ever more
/// than 20 times, while a bomb of a few megabytes would keep its reader busy or fill the memory.
constexpr std::uint64_t most_expanded(std::uint64_t compressed_bytes) {
    constexpr std::uint64_t kMostExpansion = 100, kAlwaysFits = std::uint64_t{1} << 26;
    return std::max(kAlwaysFits, kMostExpansion * compressed_bytes);
}

/// Reads a whole mesh file, decompressed. \throw IoError; InputError if the compressed data are damaged, or
/// expand to more than most_expanded()
FileContent read_content(const std::filesystem::path& path, Compression compression);

}  // namespace marrow::internal::io
