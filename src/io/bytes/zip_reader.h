// Reading ZIP archives.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "file_content.h"

namespace marrow {

/// The files of a ZIP archive, stored or deflated, of at most 4 GiB each.
class ZipReader {
  public:
    /// \pre archive outlives this. \throw InputError no ZIP archive, or one that is damaged
    explicit ZipReader(const FileContent& archive);

    /// A file's bytes; small and capital letters in names are the same. \throw InputError it is not there,
    /// damaged, or not kept in a way that can be read
    std::string file(std::string_view name) const;

  private:
    struct Entry {
        std::string name;  // in small letters
        std::uint64_t method = 0, flags = 0, checksum = 0, compressed_size = 0, size = 0, offset = 0;
    };
    std::uint64_t number(std::uint64_t at, int bytes) const;
    void take_large_sizes(Entry& entry, std::uint64_t at, std::uint64_t end) const;

    const FileContent& archive_;
    std::vector<Entry> entries_;
};

}  // namespace marrow
