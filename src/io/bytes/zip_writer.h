/// Writes ZIP archives by libarchive.
#pragma once

#include <cstddef>
#include <exception>
#include <memory>
#include <string>

#include <marrow/atomic_file.h>

struct archive;

namespace marrow::internal::io {

/// Writes a ZIP archive, file by file. The time of each file is 1980-01-01.
class ZipWriter {
  public:
    /// \pre `file` is empty and outlives the writer
    explicit ZipWriter(AtomicFile& file);

    /// Begins a file of the archive; the one before ends.
    void begin(const std::string& name);
    /// Appends to the current file.
    void write(const void* data, std::size_t bytes);
    /// Ends the archive.
    void finish();

  private:
    struct Callbacks;
    struct Close {
        void operator()(archive* opened) const;
    };
    void check(long result);

    AtomicFile& file_;
    std::exception_ptr thrown_;  // by the file; it must not pass through libarchive
    std::unique_ptr<archive, Close> opened_;
};

}  // namespace marrow::internal::io
