// Decodes the bytes of chunks: Blosc, gzip, Zstandard, LZ4, and the checksum of Zarr 3.
#include "codecs.h"

#include <blosc.h>
#include <lz4.h>
#include <zlib.h>
#include <zstd.h>

#include <array>
#include <climits>
#include <cstring>

namespace marrow::internal::io {

namespace {

bool decompress_blosc(std::span<const std::byte> from, std::span<std::byte> to) {
    std::size_t size = 0;
    if (blosc_cbuffer_validate(from.data(), from.size(), &size) != 0 || size != to.size()) return false;
    return blosc_decompress_ctx(from.data(), to.data(), to.size(), 1) == static_cast<int>(to.size());
}

bool decompress_gzip(std::span<const std::byte> from, std::span<std::byte> to) {
    if (from.size() > UINT_MAX || to.size() > UINT_MAX) return false;
    constexpr int kGzipOrZlib = 15 + 32;
    z_stream stream{};
    if (inflateInit2(&stream, kGzipOrZlib) != Z_OK) return false;
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(from.data()));
    stream.avail_in = static_cast<uInt>(from.size());
    stream.next_out = reinterpret_cast<Bytef*>(to.data());
    stream.avail_out = static_cast<uInt>(to.size());
    const int result = inflate(&stream, Z_FINISH);
    inflateEnd(&stream);
    return result == Z_STREAM_END && stream.avail_out == 0;
}

bool decompress_zstd(std::span<const std::byte> from, std::span<std::byte> to) {
    return ZSTD_decompress(to.data(), to.size(), from.data(), from.size()) == to.size();
}

// The size comes before the data, as numcodecs writes them.
bool decompress_lz4(std::span<const std::byte> from, std::span<std::byte> to) {
    std::uint32_t size = 0;
    if (from.size() < sizeof size || from.size() > INT_MAX || to.size() > INT_MAX) return false;
    std::memcpy(&size, from.data(), sizeof size);
    if (size != to.size()) return false;
    return LZ4_decompress_safe(reinterpret_cast<const char*>(from.data() + sizeof size),
                               reinterpret_cast<char*>(to.data()),
                               static_cast<int>(from.size() - sizeof size),
                               static_cast<int>(to.size())) == static_cast<int>(to.size());
}

constexpr std::array<std::uint32_t, 256> make_crc32c_table() {
    std::array<std::uint32_t, 256> table{};
    for (std::uint32_t byte = 0; byte < 256; ++byte) {
        std::uint32_t value = byte;
        for (int bit = 0; bit < 8; ++bit) value = value >> 1 ^ (value & 1 ? 0x82F63B78U : 0U);
        table[byte] = value;
    }
    return table;
}

std::uint32_t crc32c(std::span<const std::byte> bytes) {
    static constexpr std::array<std::uint32_t, 256> kTable = make_crc32c_table();
    std::uint32_t value = ~0U;
    for (const std::byte byte : bytes)
        value = value >> 8 ^ kTable[(value ^ static_cast<std::uint32_t>(byte)) & 0xFF];
    return ~value;
}

// The most bytes that one byte can become, so that a small chunk cannot ask for much memory.
std::size_t most_inflation(Compressor compressor) {
    switch (compressor) {
        case Compressor::gzip:
            return 1032;  // 258 bytes of a repeated match are two bits
        case Compressor::lz4:
            return 255;          // a byte of a match's length
        case Compressor::blosc:  // it may hold Zstandard
        case Compressor::zstd:
            return 32768;  // four bytes are a block of 128 KiB with one value
    }
    return 0;
}

}  // namespace

std::optional<Compressor> find_compressor(std::string_view name) {
    if (name == "blosc") return Compressor::blosc;
    if (name == "gzip" || name == "zlib") return Compressor::gzip;
    if (name == "zstd") return Compressor::zstd;
    if (name == "lz4") return Compressor::lz4;
    return {};
}

bool decode(std::span<const std::byte> bytes, const ByteCodecs& codecs, std::size_t size,
            std::vector<std::byte>& out) {
    if (codecs.checksum) {
        std::uint32_t stated = 0;
        if (bytes.size() < sizeof stated) return false;
        const auto content = bytes.first(bytes.size() - sizeof stated);
        std::memcpy(&stated, content.data() + content.size(), sizeof stated);
        if (crc32c(content) != stated) return false;
        bytes = content;
    }
    if (!codecs.compressor) {
        if (bytes.size() != size) return false;
        out.assign(bytes.begin(), bytes.end());
        return true;
    }
    if (size / most_inflation(*codecs.compressor) > bytes.size()) return false;
    out.resize(size);
    switch (*codecs.compressor) {
        case Compressor::blosc:
            return decompress_blosc(bytes, out);
        case Compressor::gzip:
            return decompress_gzip(bytes, out);
        case Compressor::zstd:
            return decompress_zstd(bytes, out);
        case Compressor::lz4:
            return decompress_lz4(bytes, out);
    }
    return false;
}

}  // namespace marrow::internal::io
