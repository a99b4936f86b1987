// Reads uncompressed BMP images: 8 bits with a grey palette, or 24 or 32 bits with equal channels.
#include "image_decoders.h"

#include <array>

#include "base/checked_size.h"

namespace marrow::internal::io {

ImageHeader read_bmp(const std::filesystem::path& path, const ImageTarget& target) {
    const Bytes bytes = file_bytes(path);
    const auto at = [&](std::size_t offset, std::size_t size) {
        if (bytes.size() < offset + size) throw kDamaged;
        std::uint32_t out = 0;
        for (std::size_t i = 0; i < size; ++i)
            out |= static_cast<std::uint32_t>(bytes[offset + i]) << (8 * i);
        return out;
    };
    const std::size_t data = at(10, 4), header = at(14, 4);
    if (header < 40 || header > 200) throw UnreadableImage{"is an unsupported kind of BMP"};
    const auto columns = static_cast<std::int32_t>(at(18, 4)), rows = static_cast<std::int32_t>(at(22, 4));
    const std::uint32_t bits = at(28, 2), compression = at(30, 4), used = at(46, 4);
    if ((bits != 8 && bits != 24 && bits != 32) || compression != 0 || used > 256) throw kOddSamples;
    if (columns <= 0 || rows == 0 || rows == INT32_MIN) throw kDamaged;
    const auto grey_of = [](std::uint32_t colour) {
        if ((colour & 0xff) != (colour >> 8 & 0xff) || (colour & 0xff) != (colour >> 16 & 0xff))
            throw kInColour;
        return static_cast<unsigned char>(colour);
    };
    std::array<unsigned char, 256> palette{};
    for (std::size_t i = 0; bits == 8 && i < (used ? used : 256); ++i)
        palette[i] = grey_of(at(14 + header + 4 * i, 4));
    const std::size_t height = static_cast<std::size_t>(rows > 0 ? rows : -static_cast<std::int64_t>(rows));
    const std::size_t width = static_cast<std::size_t>(columns), pixel = bits / 8;
    const std::size_t line = checked_size((std::uint64_t{width} * pixel + 3) / 4 * 4);
    if (data > bytes.size() || (bytes.size() - data) / line < height) throw kDamaged;
    const ImageHeader out{columns, static_cast<std::int64_t>(height), 1, SampleType::uint8};
    if (!target.takes(out)) return out;
    for (std::size_t row = 0; row < height; ++row) {
        // The rows start at the bottom, unless the height is negative.
        const std::size_t from = data + (rows > 0 ? height - 1 - row : row) * line;
        for (std::size_t i = 0; i < width; ++i)
            target.bytes()[row * width + i] =
                pixel == 1 ? palette[bytes[from + i]] : grey_of(at(from + i * pixel, 3));
    }
    return out;
}

}  // namespace marrow::internal::io
