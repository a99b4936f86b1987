/// Compresses output: gzip streams and ZIP archives.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <marrow/atomic_file.h>

namespace marrow::internal::io {

/// Compresses bytes and passes them on to `write`. The same input always gives the same output.
class Deflater {
  public:
    using Write = std::function<void(const void* data, std::size_t bytes)>;
    enum class Wrapping { none, gzip };

    Deflater(Wrapping wrapping, Write write);
    ~Deflater();

    void write(const void* data, std::size_t bytes);
    /// Writes the rest. \pre no write follows
    void finish();
    std::uint64_t written() const;  ///< compressed bytes so far

  private:
    struct State;
    std::unique_ptr<State> state_;
};

/// Writes a ZIP archive, file by file. The time of each file is 1980-01-01.
class ZipWriter {
  public:
    /// \pre `file` is empty and outlives the writer
    explicit ZipWriter(AtomicFile& file) : file_(file) {}

    /// Begins a file of the archive; the one before ends.
    void begin(const std::string& name);
    /// Appends to the current file. \throw LimitError the file has more than 4 GiB
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
    std::unique_ptr<Deflater> deflater_;  // of the last entry while it is open
    std::uint64_t end_ = 0;               // bytes in the archive so far
};

}  // namespace marrow::internal::io
