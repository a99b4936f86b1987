// Reads samples that are stored as in memory, or compressed by zlib.
#include "raw_image.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <type_traits>

#include <marrow/error.h>

#include "base/progress.h"
#include "io/bytes/byte_stream.h"
#include "io/bytes/text.h"

namespace marrow::internal::io {

namespace {

// Calls `f` with a value of the C++ type of `type`.
template <class F>
auto with_stored_type(StoredType type, F&& f) {
    switch (type) {
        case StoredType::uint8:
            return f(std::uint8_t{});
        case StoredType::int8:
            return f(std::int8_t{});
        case StoredType::uint16:
            return f(std::uint16_t{});
        case StoredType::int16:
            return f(std::int16_t{});
        case StoredType::uint32:
            return f(std::uint32_t{});
        case StoredType::int32:
            return f(std::int32_t{});
        case StoredType::uint64:
            return f(std::uint64_t{});
        case StoredType::int64:
            return f(std::int64_t{});
        case StoredType::float32:
            return f(float{});
        case StoredType::float64:
            return f(double{});
    }
    throw InputError("unknown sample type");
}

std::size_t stored_size(StoredType type) {
    return with_stored_type(type, [](auto v) { return sizeof v; });
}

template <class Word, class Swap>
void swap_words(void* data, std::size_t count, Swap&& swap) {
    auto* words = static_cast<Word*>(data);
    for (std::size_t i = 0; i < count; ++i) words[i] = swap(words[i]);
}

void swap_bytes(void* data, std::size_t count, std::size_t size) {
    if (size == 2)
        swap_words<std::uint16_t>(data, count, [](std::uint16_t w) { return __builtin_bswap16(w); });
    if (size == 4)
        swap_words<std::uint32_t>(data, count, [](std::uint32_t w) { return __builtin_bswap32(w); });
    if (size == 8)
        swap_words<std::uint64_t>(data, count, [](std::uint64_t w) { return __builtin_bswap64(w); });
}

template <class S, class T>
void convert(const S* from, T* to, std::size_t count, const RawImage& image) {
    constexpr bool kMayRound = std::is_integral_v<S> && sizeof(S) == 8;
    for (std::size_t i = 0; i < count; ++i) {
        const auto value = static_cast<double>(from[i]);
        if constexpr (kMayRound) {
            if (std::abs(value) >= 9007199254740992.0) {  // 2^53
                throw InputError(
                    fmt::format("{}: a 64-bit sample is beyond 2^53 and cannot be kept exactly; "
                                "convert the file to a smaller type",
                                quoted(image.files[0])));
            }
        }
        to[i] = static_cast<T>(image.slope * value + image.intercept);
    }
}

// Returns the number of bytes of samples in each file.
// \throw InputError the header claims more than the files can hold
std::uint64_t checked_file_bytes(const RawImage& image) {
    // Deflate writes 258 bytes of a repeated match as two bits.
    constexpr double kMostInflation = 1032;

    const double samples = static_cast<double>(image.geometry.dims[0]) *
                           static_cast<double>(image.geometry.dims[1]) *
                           static_cast<double>(image.geometry.dims[2]);
    const double file_bytes = samples * static_cast<double>(stored_size(image.type)) *
                              static_cast<double>(image.volumes - image.volume) /
                              static_cast<double>(image.files.size());
    for (const auto& path : image.files) {
        const double held =
            static_cast<double>(regular_file_size(path)) - static_cast<double>(image.file_offset.value_or(0));
        const double needed = file_bytes + static_cast<double>(image.data_offset);
        if (needed > (image.compressed ? held * kMostInflation : held)) {
            throw InputError(
                fmt::format("{}: the header claims {:.0f} bytes of samples but the file has {:.0f}; "
                            "it is truncated, or the header is wrong",
                            quoted(path), file_bytes, std::max(held, 0.0)));
        }
    }
    check_geometry(image.geometry);
    const auto count = static_cast<std::uint64_t>(image.geometry.sample_count());
    if (count % image.files.size() != 0) {
        throw InputError(fmt::format("{}: {} samples cannot be divided evenly among {} data files",
                                     quoted(image.files[0]), count, image.files.size()));
    }
    return count / image.files.size() * stored_size(image.type);
}

// Reads the next `count` samples of a stream and converts them. Calls done(n) after each n samples.
template <class Done>
void read_samples(ByteStream& stream, const RawImage& image, std::size_t count, std::byte* out,
                  const Done& done) {
    constexpr std::size_t kChunkSamples = std::size_t{1} << 20;
    const SampleType type = loaded_type(image);
    const std::size_t stored = stored_size(image.type);
    const bool as_is = image.slope == 1 && image.intercept == 0 && image.type != StoredType::uint32 &&
                       image.type != StoredType::uint64 && image.type != StoredType::int64;
    const bool swap = image.big_endian != (std::endian::native == std::endian::big);
    std::vector<std::byte> chunk(as_is ? 0 : std::min(count, kChunkSamples) * stored);
    while (count > 0) {
        const std::size_t n = std::min(count, kChunkSamples);
        std::byte* to = as_is ? out : chunk.data();
        stream.read(to, n * stored);
        if (swap) swap_bytes(to, n, stored);
        if (!as_is) {
            with_stored_type(image.type, [&]<class S>(S) {
                const auto* from = reinterpret_cast<const S*>(chunk.data());
                if (type == SampleType::float32)
                    convert(from, reinterpret_cast<float*>(out), n, image);
                else
                    convert(from, reinterpret_cast<double*>(out), n, image);
            });
        }
        out += n * sample_size(type);
        count -= n;
        done(n);
    }
}

// The offset of the (compressed) data in a file.
std::uint64_t data_begin(const RawImage& image, const std::filesystem::path& path, std::uint64_t file_bytes) {
    return image.file_offset
               ? static_cast<std::uint64_t>(*image.file_offset)
               : regular_file_size(path) - file_bytes * static_cast<std::uint64_t>(image.volumes);
}

}  // namespace

void set_columns(Geometry& geometry, const Mat3d& m) {
    for (int axis = 0; axis < 3; ++axis) {
        const double length = std::hypot(m[0][axis], m[1][axis], m[2][axis]);
        geometry.spacing[axis] = length;
        for (int row = 0; row < 3; ++row)
            geometry.direction[row][axis] = length > 0 ? m[row][axis] / length + 0.0 : 0;  // + 0.0 avoids -0
    }
}

SampleType loaded_type(const RawImage& image) {
    const bool rescaled = image.slope != 1 || image.intercept != 0;
    switch (image.type) {
        case StoredType::uint8:
            return rescaled ? SampleType::float32 : SampleType::uint8;
        case StoredType::int8:
            return rescaled ? SampleType::float32 : SampleType::int8;
        case StoredType::uint16:
            return rescaled ? SampleType::float32 : SampleType::uint16;
        case StoredType::int16:
            return rescaled ? SampleType::float32 : SampleType::int16;
        case StoredType::int32:
            return rescaled ? SampleType::float64 : SampleType::int32;
        case StoredType::float32:
            return SampleType::float32;
        default:
            return SampleType::float64;
    }
}

void check_claims(const RawImage& image) {
    checked_file_bytes(image);
}

void choose_volume(RawImage& image, double count, std::optional<std::int64_t> volume) {
    if (!volume && count != 1) {
        throw GeometryError(
            fmt::format("{}: holds {:.0f} volumes; choose one from 0 to {:.0f} with options.volume",
                        quoted(image.files[0]), count, count - 1));
    }
    if (volume && (*volume < 0 || static_cast<double>(*volume) >= count)) {
        throw OptionError(fmt::format("{}: has no volume {}; there are {:.0f}, numbered from 0",
                                      quoted(image.files[0]), *volume, count));
    }
    if (count > 1 && image.files.size() > 1)
        throw InputError(fmt::format("{}: several volumes in several data files are not supported",
                                     quoted(image.files[0])));
    const auto& dims = image.geometry.dims;
    const double bytes = static_cast<double>(dims[0]) * static_cast<double>(dims[1]) *
                         static_cast<double>(dims[2]) * static_cast<double>(stored_size(image.type));
    if (count * bytes > 9e18)
        throw InputError(fmt::format("{}: the header claims {:.0f} volumes of {:.0f} bytes",
                                     quoted(image.files[0]), count, bytes));
    image.volumes = static_cast<std::int64_t>(count);
    image.volume = volume.value_or(0);
    image.data_offset += image.volume * static_cast<std::int64_t>(bytes);
}

Volume load_raw(const RawImage& image, const Progress& progress) {
    const std::uint64_t file_bytes = checked_file_bytes(image);
    Volume volume(image.geometry, loaded_type(image));
    const std::size_t kept = sample_size(volume.type());
    const std::size_t total = volume.bytes() / kept;
    const std::size_t in_file = file_bytes / stored_size(image.type);
    auto* out = static_cast<std::byte*>(volume.data());
    std::size_t done = 0;
    internal::report_progress(progress, 0);
    for (const auto& path : image.files) {
        ByteStream stream(path, image.compressed ? Compression::zlib : Compression::none,
                          data_begin(image, path, file_bytes));
        stream.skip(static_cast<std::uint64_t>(image.data_offset));
        read_samples(stream, image, in_file, out + done * kept, [&](std::size_t n) {
            done += n;
            internal::report_progress(progress, static_cast<double>(done) / static_cast<double>(total));
        });
        stream.verify_end();
    }
    return volume;
}

SliceSource raw_slices(const RawImage& image) {
    if (image.compressed) {
        throw InputError(fmt::format(
            "{}: is compressed and cannot be read slice by slice; decompress it, or read it as a whole",
            quoted(image.files[0])));
    }
    const std::uint64_t file_bytes = checked_file_bytes(image);
    const auto read = [image, file_bytes](std::int64_t z_begin, std::int64_t z_end, void* to) {
        const std::size_t stored = stored_size(image.type), kept = sample_size(loaded_type(image));
        const auto area = static_cast<std::size_t>(image.geometry.dims[0] * image.geometry.dims[1]);
        const std::size_t in_file = file_bytes / stored;
        auto* out = static_cast<std::byte*>(to);
        std::size_t at = static_cast<std::size_t>(z_begin) * area;
        for (const std::size_t end = static_cast<std::size_t>(z_end) * area; at < end;) {
            const auto& path = image.files[at / in_file];
            const std::size_t first = at % in_file, count = std::min(end - at, in_file - first);
            ByteStream stream(path, Compression::none,
                              data_begin(image, path, file_bytes) +
                                  static_cast<std::uint64_t>(image.data_offset) + first * stored);
            read_samples(stream, image, count, out, [](std::size_t) {});
            out += count * kept;
            at += count;
        }
    };
    return {image.geometry, loaded_type(image), read};
}

}  // namespace marrow::internal::io
