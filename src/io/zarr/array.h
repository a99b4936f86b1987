/// Zarr arrays: their metadata, versions 2 and 3, and their samples.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "codecs.h"
#include "io/bytes/stored_samples.h"

namespace marrow::internal::io {

/// An array, of which each chunk is a file, or with shards a part of a file. Axes are in the array's
/// order, the first changes slowest.
struct ZarrArray {
    using Index = std::vector<std::int64_t>;

    /// Where the chunks of a shard are: the shard's index holds the offset and the size of each.
    struct ShardIndex {
        Index chunks;  ///< of a whole shard, along each axis
        bool at_start = false;
        bool checksum = false;
    };

    std::filesystem::path folder;
    Index shape;
    Index chunk;                      ///< the samples of a chunk along each axis
    std::optional<ShardIndex> index;  ///< if the files are shards
    StoredType type = StoredType::uint8;
    bool big_endian = false;
    std::vector<std::byte> fill;     ///< one sample, in native order, for the chunks that are missing
    std::vector<std::size_t> order;  ///< axes of a chunk in memory, the slowest first
    ByteCodecs codecs;
    std::string prefix, separator;  ///< of the files' names: the prefix, then the indices with separators
};

/// Whether a folder is a Zarr array or group.
bool is_zarr(const std::filesystem::path& folder);

/// Reads the metadata of an array.
/// \throw IoError; InputError they are damaged, or a sample type, codec or filter is not supported
ZarrArray read_zarr_array(const std::filesystem::path& folder);

/// Reads the samples from `begin` to `end` in C order, as stored but in native byte order, on the threads
/// around. Chunks that are missing have the fill value. Calls done() after each chunk, from any thread.
/// Unless `known` is empty, known(index) returns null, or a sample, as stored but in native byte order, that
/// stands for all of a chunk, which is then not read.
/// \throw IoError; InputError a chunk is damaged; what done() throws
void read_zarr(const ZarrArray& array, const ZarrArray::Index& begin, const ZarrArray::Index& end,
               void* samples, const std::function<void()>& done,
               const std::function<const void*(const ZarrArray::Index& chunk)>& known = {});

/// The number of calls of done() in read_zarr.
std::size_t count_chunks(const ZarrArray& array, const ZarrArray::Index& begin, const ZarrArray::Index& end);

}  // namespace marrow::internal::io
