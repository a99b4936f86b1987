// Reads the samples of Zarr arrays, chunk by chunk.
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <optional>

#include <marrow/error.h>

#include "array.h"
#include "base/parallel.h"
#include "io/bytes/byte_stream.h"
#include "io/bytes/text.h"

namespace marrow::internal::io {

namespace fs = std::filesystem;

namespace {

using Index = ZarrArray::Index;
using KnownChunks = std::function<const void*(const Index& chunk)>;

// A box of samples or chunks of an array.
struct Box {
    Index begin, end;

    std::size_t count() const {
        std::size_t n = 1;
        for (std::size_t a = 0; a < begin.size(); ++a) n *= static_cast<std::size_t>(end[a] - begin[a]);
        return n;
    }
    // Element number i, in C order.
    Index at(std::size_t i) const {
        Index out(begin.size());
        for (std::size_t a = begin.size(); a-- > 0;) {
            const auto size = static_cast<std::size_t>(end[a] - begin[a]);
            out[a] = begin[a] + static_cast<std::int64_t>(i % size);
            i /= size;
        }
        return out;
    }
};

// The boxes of a grid that a box of samples overlaps.
Box overlapping(const Box& samples, const Index& size) {
    Box out = samples;
    for (std::size_t a = 0; a < size.size(); ++a) {
        out.begin[a] /= size[a];
        out.end[a] = (out.end[a] - 1) / size[a] + 1;
    }
    return out;
}

// The part of box number `index` of a grid that lies in `samples`.
Box part_in(const Box& samples, const Index& index, const Index& size) {
    Box out = samples;
    for (std::size_t a = 0; a < size.size(); ++a) {
        out.begin[a] = std::max(out.begin[a], index[a] * size[a]);
        out.end[a] = std::min(out.end[a], (index[a] + 1) * size[a]);
    }
    return out;
}

class BoxReader {
  public:
    BoxReader(const ZarrArray& array, const Box& box, void* samples, const std::function<void()>& done,
              const KnownChunks& known)
        : array_(array),
          box_(box),
          samples_(static_cast<std::byte*>(samples)),
          done_(done),
          known_(known),
          size_(stored_size(array.type)) {
        const std::size_t axes = array.shape.size();
        file_ = array.chunk;
        to_step_.assign(axes, size_);
        from_step_.assign(axes, size_);
        in_one_row_.assign(axes, 0);
        in_one_row_.back() = size_;
        for (std::size_t a = axes - 1; a > 0; --a)
            to_step_[a - 1] = to_step_[a] * static_cast<std::size_t>(box.end[a] - box.begin[a]);
        for (std::size_t k = axes - 1; k > 0; --k)
            from_step_[array.order[k - 1]] =
                from_step_[array.order[k]] * static_cast<std::size_t>(array.chunk[array.order[k]]);
        chunk_samples_ = 1;
        for (std::size_t a = 0; a < axes; ++a) {
            chunk_samples_ *= static_cast<std::size_t>(array.chunk[a]);
            if (array.index) file_[a] *= array.index->chunks[a];
        }
    }

    void read() const {
        const Box files = overlapping(box_, file_);
        parallel_for(std::size_t{0}, files.count(), [&](std::size_t i) { read_file(files.at(i)); });
    }

  private:
    // The bytes of one chunk. Each thread keeps its memory from chunk to chunk: to get it anew from the
    // system would take as long as to decompress the chunk.
    struct Buffers {
        std::vector<std::byte> stored, decoded, row;
    };

    void read_file(const Index& file) const {
        const fs::path path =
            array_.folder / (array_.prefix + fmt::format("{}", fmt::join(file, array_.separator)));
        const Box samples = part_in(box_, file, file_);
        if (!array_.index && fill_known(file, samples)) return;
        const bool exists = is_there(path);
        if (array_.index) return read_shard(path, exists, file, samples);
        Buffers& buffers = buffers_.local();
        if (exists) read_bytes(path, 0, std::nullopt, buffers.stored);
        place(path, exists, buffers, file, samples);
    }

    // git-annex and DataLad leave a link that leads nowhere for a file that is not on this machine.
    static bool is_there(const fs::path& path) {
        std::error_code error;
        const fs::file_status status = fs::symlink_status(path, error);
        if (status.type() == fs::file_type::none)
            throw IoError(fmt::format("{}: cannot be opened: {}", quoted(path), error.message()));
        if (fs::is_symlink(status) && !fs::exists(path, error))
            throw IoError(
                fmt::format("{}: is a link to a file that is missing; fetch it first", quoted(path)));
        return fs::exists(status);
    }

    void read_shard(const fs::path& path, bool exists, const Index& file, const Box& samples) const {
        const std::vector<std::uint64_t> index = exists ? read_index(path) : std::vector<std::uint64_t>();
        const Box chunks = overlapping(samples, array_.chunk);
        parallel_for(std::size_t{0}, chunks.count(), [&](std::size_t i) {
            const Index chunk = chunks.at(i);
            const Box samples_in_chunk = part_in(samples, chunk, array_.chunk);
            if (fill_known(chunk, samples_in_chunk)) return;
            std::size_t within = 0;
            for (std::size_t a = 0; a < chunk.size(); ++a)
                within = within * static_cast<std::size_t>(array_.index->chunks[a]) +
                         static_cast<std::size_t>(chunk[a] - file[a] * array_.index->chunks[a]);
            constexpr std::uint64_t kMissing = ~std::uint64_t{0};
            const bool is_stored = exists && index[2 * within] != kMissing;
            Buffers& buffers = buffers_.local();
            if (is_stored) read_bytes(path, index[2 * within], index[2 * within + 1], buffers.stored);
            place(path, is_stored, buffers, chunk, samples_in_chunk);
        });
    }

    // The offset and the size of each chunk of a shard.
    std::vector<std::uint64_t> read_index(const fs::path& path) const {
        std::size_t chunks = 1;
        for (const std::int64_t n : array_.index->chunks) chunks *= static_cast<std::size_t>(n);
        const ByteCodecs codecs{.compressor = {}, .checksum = array_.index->checksum};
        const std::uint64_t stored = 16 * chunks + (codecs.checksum ? 4 : 0), held = regular_file_size(path);
        if (held < stored) refuse(path);
        Buffers& buffers = buffers_.local();
        read_bytes(path, array_.index->at_start ? 0 : held - stored, stored, buffers.stored);
        if (!decode(buffers.stored, codecs, 16 * chunks, buffers.decoded)) refuse(path);
        std::vector<std::uint64_t> index(2 * chunks);
        std::memcpy(index.data(), buffers.decoded.data(), buffers.decoded.size());
        to_native_order(index.data(), index.size(), StoredType::uint64, false);
        return index;
    }

    // Reads `size` bytes of a file, or all that follow. It is opened once and then asked for its size: on a
    // distributed file system, each question by its path takes as long as to read a small chunk.
    void read_bytes(const fs::path& path, std::uint64_t offset, std::optional<std::uint64_t> size,
                    std::vector<std::byte>& bytes) const {
        ByteStream file(path, Compression::none);
        const std::uint64_t held = file.file_size();
        if (offset > held) refuse(path);
        const std::uint64_t count = size.value_or(held - offset);
        // No compressor makes its input much larger.
        if (count > held - offset || count > 2 * chunk_samples_ * size_ + (1 << 20) + index_bytes())
            refuse(path);
        if (offset > 0) file.seek(offset);
        bytes.resize(count);
        file.read(bytes.data(), bytes.size());
    }

    std::uint64_t index_bytes() const {
        std::uint64_t bytes = 16;
        if (array_.index)
            for (const std::int64_t n : array_.index->chunks) bytes *= static_cast<std::uint64_t>(n);
        return bytes;
    }

    // Puts the samples of a chunk that lie in the box at their place.
    void place(const fs::path& path, bool exists, Buffers& buffers, const Index& chunk,
               const Box& samples) const {
        if (!exists) return fill(buffers, samples, array_.fill.data());
        if (!decode(buffers.stored, array_.codecs, chunk_samples_ * size_, buffers.decoded)) refuse(path);
        to_native_order(buffers.decoded.data(), chunk_samples_, array_.type, array_.big_endian);
        std::size_t from = 0;
        for (std::size_t a = 0; a < chunk.size(); ++a)
            from += static_cast<std::size_t>(samples.begin[a] - chunk[a] * array_.chunk[a]) * from_step_[a];
        copy(samples, 0, buffers.decoded.data() + from, from_step_, place_of(samples));
        done_();
    }

    // Gives the samples of a chunk the value that it is known by, if there is one.
    bool fill_known(const Index& chunk, const Box& samples) const {
        const void* const value = known_ ? known_(chunk) : nullptr;
        if (value != nullptr) fill(buffers_.local(), samples, static_cast<const std::byte*>(value));
        return value != nullptr;
    }

    void fill(Buffers& buffers, const Box& samples, const std::byte* value) const {
        std::vector<std::byte>& row = buffers.row;
        row.resize(static_cast<std::size_t>(samples.end.back() - samples.begin.back()) * size_);
        for (std::size_t i = 0; i < row.size(); i += size_) std::memcpy(row.data() + i, value, size_);
        copy(samples, 0, row.data(), in_one_row_, place_of(samples));
        done_();
    }

    std::byte* place_of(const Box& samples) const {
        std::size_t to = 0;
        for (std::size_t a = 0; a < samples.begin.size(); ++a)
            to += static_cast<std::size_t>(samples.begin[a] - box_.begin[a]) * to_step_[a];
        return samples_ + to;
    }

    // Copies the samples from `axis` on, which are `from_step` bytes from each other.
    void copy(const Box& samples, std::size_t axis, const std::byte* from,
              const std::vector<std::size_t>& from_step, std::byte* to) const {
        const auto count = static_cast<std::size_t>(samples.end[axis] - samples.begin[axis]);
        const bool is_last = axis + 1 == samples.begin.size();
        if (is_last && from_step[axis] == size_) {
            std::memcpy(to, from, count * size_);
            return;
        }
        for (std::size_t i = 0; i < count; ++i, from += from_step[axis], to += to_step_[axis]) {
            if (is_last)
                std::memcpy(to, from, size_);
            else
                copy(samples, axis + 1, from, from_step, to);
        }
    }

    [[noreturn]] static void refuse(const fs::path& path) {
        throw InputError(
            fmt::format("{}: this chunk of the Zarr array is damaged or truncated", quoted(path)));
    }

    const ZarrArray& array_;
    const Box& box_;
    std::byte* samples_;
    const std::function<void()>& done_;
    const KnownChunks& known_;
    std::size_t size_;  // of a sample
    Index file_;        // samples of a file along each axis
    std::vector<std::size_t> from_step_,
        to_step_;                          // bytes from one sample to the next, in a chunk and in the box
    std::vector<std::size_t> in_one_row_;  // the same, if one row stands for all of a chunk
    std::size_t chunk_samples_ = 1;
    mutable PerThread<Buffers> buffers_;
};

}  // namespace

void read_zarr(const ZarrArray& array, const Index& begin, const Index& end, void* samples,
               const std::function<void()>& done, const KnownChunks& known) {
    const Box box{begin, end};
    BoxReader(array, box, samples, done, known).read();
}

std::size_t count_chunks(const ZarrArray& array, const Index& begin, const Index& end) {
    return overlapping({begin, end}, array.chunk).count();
}

}  // namespace marrow::internal::io
