/// Reads ZIP archives.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "file_content.h"

namespace marrow::internal::io {

/// A ZIP archive. Its files are stored or deflated and have at most 4 GiB each.
class ZipReader {
  public:
    /// \pre the archive outlives the reader. \throw InputError it is not a ZIP archive, or damaged
    explicit ZipReader(const FileContent& archive);

    /// A file's bytes; names match in either case.
    /// \throw InputError it is missing, damaged, encrypted or compressed by another method
    std::string file(std::string_view name) const;

  private:
    struct Entry {
        std::string name;  // in lower case
        std::uint64_t method = 0, flags = 0, checksum = 0, compressed_size = 0, size = 0, offset = 0;
    };
    std::uint64_t number(std::uint64_t at, int bytes) const;  // little-endian
    void read_zip64_sizes(Entry& entry, std::uint64_t at, std::uint64_t end) const;

    const FileContent& archive_;
    std::vector<Entry> entries_;
};

}  // namespace marrow::internal::io
