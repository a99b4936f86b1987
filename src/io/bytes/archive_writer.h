/// Writes ZIP archives and gzip files by libarchive.
#pragma once

#include <cstddef>
#include <exception>
#include <memory>
#include <string>

#include <marrow/atomic_file.h>

struct archive;

namespace marrow::internal::io {

/// Writes a ZIP archive, file by file, or one file compressed by gzip. The same content always gives the same
/// bytes: the archive states no times.
class ArchiveWriter {
  public:
    enum class Format { zip, gzip };

    /// \pre `file` is empty and outlives the writer
    ArchiveWriter(AtomicFile& file, Format format);

    /// Begins a file of the archive; the one before ends. A gzip file is one file, whose name is not written.
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
