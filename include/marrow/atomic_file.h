/// Files that appear whole or not at all.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string_view>

#include <marrow/export.h>

namespace marrow {

/// A new file that takes its place only when it is complete and on the disk.
///
/// What is written goes to a temporary file in the target's folder; finish() flushes it to the disk and commit()
/// renames it. Until then an old file of that name is untouched; without commit() the destructor removes the
/// temporary file. A target that is a symbolic link is followed. Every member throws IoError when the system
/// says no.
class MARROW_EXPORT AtomicFile {
  public:
    /// Opens the temporary file. \throw IoError also where the target exists and is not a regular file.
    explicit AtomicFile(const std::filesystem::path& target);
    ~AtomicFile();
    AtomicFile(const AtomicFile&) = delete;
    AtomicFile& operator=(const AtomicFile&) = delete;

    /// Writes behind what was written last; unbuffered, so hand over large pieces.
    void write(const void* data, std::size_t bytes);
    void write(std::string_view text) { write(text.data(), text.size()); }
    /// The next write goes to this many bytes from the start.
    void seek(std::uint64_t offset);
    /// Flushes and closes the temporary file: what can fail before it is in its place has not. Nothing may be
    /// written afterwards.
    void finish();
    /// Puts the file in its place, finished first where it is not yet.
    void commit();

  private:
    [[noreturn]] void fail(int error) const;

    std::filesystem::path named_;   // as the caller wrote it, for messages
    std::filesystem::path target_;  // with symbolic links followed
    std::filesystem::path temporary_;
    int descriptor_ = -1;
    bool finished_ = false;
};

}  // namespace marrow
