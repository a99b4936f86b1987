/// Writes files that appear complete or not at all.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string_view>

#include <marrow/export.h>

namespace marrow {

/// A new file that replaces its target only when it is complete and on the disk.
///
/// The content goes to a temporary file in the target's folder. finish() flushes it to the disk and commit()
/// renames it to the target. Until then an older target is untouched. Without commit() the destructor removes
/// the temporary file. If the target is a symbolic link, the file that it points to is replaced, or made.
/// \throw IoError every member function, if the system reports an error
class MARROW_EXPORT AtomicFile {
  public:
    /// Opens the temporary file. \throw IoError also if the target exists and is not a regular file
    explicit AtomicFile(const std::filesystem::path& target);
    ~AtomicFile();
    AtomicFile(const AtomicFile&) = delete;
    AtomicFile& operator=(const AtomicFile&) = delete;

    /// Appends bytes, or overwrites after seek(). There is no buffer: pass large blocks.
    void write(const void* data, std::size_t bytes);
    void write(std::string_view text) { write(text.data(), text.size()); }
    /// Moves the position of the next write to this many bytes from the start.
    void seek(std::uint64_t offset);
    /// The temporary file, so that other processes can write to it too.
    const std::filesystem::path& temporary() const { return temporary_; }
    /// Flushes and closes the temporary file, so that only the rename, and flushing its folder, can still
    /// fail. \pre no write follows
    void finish();
    /// Renames the file to its target, after finish() if that was not called.
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
