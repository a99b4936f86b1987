/// Decodes the bytes of chunks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace marrow::internal::io {

enum class Compressor { blosc, gzip, zstd, lz4 };

/// The compressor that Zarr metadata name so; gzip reads zlib too. No value if it is not supported.
std::optional<Compressor> find_compressor(std::string_view name);

/// What has been done to the bytes of a chunk, last.
struct ByteCodecs {
    std::optional<Compressor> compressor;
    bool checksum = false;  ///< a CRC-32C follows
};

/// Decodes `bytes`, which must give exactly `size` bytes, to `out`, whose memory is used
/// again. False if they are damaged.
bool decode(std::span<const std::byte> bytes, const ByteCodecs& codecs, std::size_t size,
            std::vector<std::byte>& out);

}  // namespace marrow::internal::io
