/// Reads ZIP archives by libarchive.
#pragma once

#include <cstdint>
#include <future>
#include <memory>
#include <string>
#include <string_view>

#include "file_content.h"

struct archive;

namespace marrow::internal::io {

/// Goes through the files of a ZIP archive in their order. What it is not asked for is not decompressed.
class ZipReader {
  public:
    /// \pre the archive outlives the reader. \throw InputError it is not a ZIP archive, or damaged
    explicit ZipReader(const FileContent& archive);

    /// Goes to the next file; false after the last. \throw InputError the archive is damaged
    bool next();
    /// The file's name in lower case.
    const std::string& name() const { return name_; }
    /// The next piece of the file's bytes, valid until the next call; empty at its end. Meanwhile, another
    /// thread decompresses the piece after it.
    /// \throw InputError the file is damaged, encrypted, compressed by an unknown method, or a small one that
    /// expands to far more bytes than meshes do
    std::string_view piece();

  private:
    std::string decompress();    // the next piece
    std::string reason() const;  // of libarchive's last error
    [[noreturn]] void refuse(const std::string& why) const;

    struct Close {
        void operator()(archive* opened) const;
    };
    const FileContent& archive_;
    std::unique_ptr<archive, Close> opened_;
    std::string name_;
    std::string fault_;       // why the file cannot be read
    std::uint64_t read_ = 0;  // bytes of all files
    std::string piece_;
    std::future<std::string> ahead_;  // the last member, so that nothing is destroyed before its thread ends
};

}  // namespace marrow::internal::io
