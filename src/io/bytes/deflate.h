// Compressing what is written: gzip streams, and ZIP archives.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <marrow/atomic_file.h>

namespace marrow {

/// Deflates bytes on their way to `write`. The same bytes give the same stream.
class Deflater {
  public:
    using Write = std::function<void(const void* data, std::size_t bytes)>;
    enum class Wrapping { none, gzip };

    Deflater(Wrapping wrapping, Write write);
    ~Deflater();

    void write(const void* data, std::size_t bytes);
    /// Writes what is left; nothing may follow.
    void finish();
    std::uint64_t written() const;  ///< compressed bytes so far

  private:
    struct State;
    std::unique_ptr<State> state_;
};

/// A ZIP archive, file by file, with file times left at 1980-01-01.
class ZipWriter {
  public:
    /// \pre nothing is in `file` yet, and it outlives this
    explicit ZipWriter(AtomicFile& file) : file_(file) {}

    /// Ends the file before and begins one of this name.
    void begin(const std::string& name);
    /// \throw LimitError more than 4 GiB in a file
    void write(const void* data, std::size_t bytes);
    /// Ends the archive.
    void finish();

  private:
    struct Entry {
        std::string name;
        std::uint64_t offset = 0, size = 0, compressed_size = 0;
        std::uint32_t checksum = 0;
    };
    void end_entry();
    std::string header_of(const Entry& entry, bool central) const;

    AtomicFile& file_;
    std::vector<Entry> entries_;
    std::unique_ptr<Deflater> deflater_;  // of the last entry, until it ends
    std::uint64_t end_ = 0;               // of what is in the file
};

}  // namespace marrow
