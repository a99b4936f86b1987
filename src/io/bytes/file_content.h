/// A file read into memory, which knows its path for error messages.
#pragma once

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

/// Reads a whole file, decompressed. \throw IoError; InputError if the compressed data are damaged
FileContent read_content(const std::filesystem::path& path, Compression compression);

}  // namespace marrow::internal::io
