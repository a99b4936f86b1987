// Reads samples that are stored as in memory, or compressed by zlib.
#include "raw_image.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include <marrow/error.h>

#include "base/checked_size.h"
#include "base/progress.h"
#include "io/bytes/byte_stream.h"
#include "io/bytes/text.h"

namespace marrow::internal::io {

namespace {

// How many samples of a file follow each other at one place.
std::size_t samples_at_a_place(const RawImage& image) {
    return image.interleaved ? static_cast<std::size_t>(image.volumes) : 1;
}

// Returns the number of bytes of a volume in each file; of all volumes if they are interleaved.
// \throw InputError the header claims more than the files can hold
std::uint64_t checked_file_bytes(const RawImage& image) {
    // Deflate writes 258 bytes of a repeated match as two bits.
    constexpr double kMostInflation = 1032;

    const double samples = static_cast<double>(image.geometry.dims[0]) *
                           static_cast<double>(image.geometry.dims[1]) *
                           static_cast<double>(image.geometry.dims[2]);
    const double file_bytes = samples * static_cast<double>(stored_size(image.type)) *
                              static_cast<double>(image.volumes - (image.interleaved ? 0 : image.volume)) /
                              static_cast<double>(image.files.size());
    for (const auto& path : image.files) {
        const double held =
            static_cast<double>(regular_file_size(path)) - static_cast<double>(image.file_offset.value_or(0));
        const double most =
            (image.compressed ? held * kMostInflation : held) - static_cast<double>(image.data_offset);
        if (file_bytes > most) {
            fail<InputError>(path,
                             "the header claims {:.0f} bytes of samples but the file {} {:.0f}; "
                             "it is truncated, or the header is wrong",
                             file_bytes, image.compressed ? "can hold at most" : "has", std::max(most, 0.0));
        }
    }
    check_stated_geometry(image.files[0], image.geometry);
    const auto count = static_cast<std::uint64_t>(image.geometry.sample_count());
    if (count % image.files.size() != 0) {
        fail<InputError>(image.files[0], "{} samples cannot be divided evenly among {} data files", count,
                         image.files.size());
    }
    return count / image.files.size() * samples_at_a_place(image) * stored_size(image.type);
}

// Keeps sample `first` of each `step` samples, at the front.
void keep_one_of(std::size_t step, std::size_t first, std::size_t size, std::vector<std::byte>& samples,
                 std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
        const std::byte* from = samples.data() + (i * step + first) * size;
        std::copy(from, from + size, samples.data() + i * size);
    }
}

// Reads the next `count` samples of the volume and converts them. Calls done(n) after each n samples.
template <class Done>
void read_samples(ByteStream& stream, const RawImage& image, std::size_t count, std::byte* out,
                  const Done& done) {
    constexpr std::size_t kChunkSamples = std::size_t{1} << 20;
    const SampleType type = loaded_type(image);
    const std::size_t stored = stored_size(image.type), step = samples_at_a_place(image);
    const bool as_stored = is_loaded_as_stored(image.type, image.rescale);
    const std::size_t most = std::min(count, std::max<std::size_t>(1, kChunkSamples / step));
    std::vector<std::byte> chunk(as_stored && step == 1 ? 0 : most * step * stored);
    while (count > 0) {
        const std::size_t n = std::min(count, most);
        std::byte* to = chunk.empty() ? out : chunk.data();
        stream.read(to, n * step * stored);
        if (step > 1) keep_one_of(step, static_cast<std::size_t>(image.volume), stored, chunk, n);
        to_native_order(to, n, image.type, image.big_endian);
        if (!as_stored)
            load_samples(to, out, n, image.type, image.rescale, image.files[0]);
        else if (to != out)
            std::copy(to, to + n * stored, out);
        out += n * sample_size(type);
        count -= n;
        done(n);
    }
}

// The offset of the (compressed) data in a file.
std::uint64_t data_begin(const RawImage& image, const std::filesystem::path& path, std::uint64_t file_bytes) {
    return image.file_offset
               ? static_cast<std::uint64_t>(*image.file_offset)
               : regular_file_size(path) -
                     file_bytes * static_cast<std::uint64_t>(image.interleaved ? 1 : image.volumes);
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
    return loaded_type(image.type, image.rescale);
}

void keep_stored(RawImage& image) {
    if (stored_size(image.type) <= 2 && can_be_kept(image.rescale))
        image.kept = std::exchange(image.rescale, Rescale{});
}

void check_claims(const RawImage& image) {
    checked_file_bytes(image);
}

void choose_volume(RawImage& image, double count, std::optional<std::int64_t> volume) {
    if (!volume && count != 1) {
        fail<GeometryError>(image.files[0],
                            "holds {:.0f} volumes; choose one from 0 to {:.0f} with options.volume{}", count,
                            count - 1, image.volume_names.empty() ? "" : ": " + examples(image.volume_names));
    }
    if (volume && (*volume < 0 || static_cast<double>(*volume) >= count)) {
        fail<OptionError>(image.files[0], "has no volume {}; there are {:.0f}, numbered from 0", *volume,
                          count);
    }
    if (count > 1 && image.files.size() > 1 && !image.interleaved)
        fail<InputError>(image.files[0], "several volumes in several data files are not supported");
    const auto& dims = image.geometry.dims;
    const double bytes = static_cast<double>(dims[0]) * static_cast<double>(dims[1]) *
                         static_cast<double>(dims[2]) * static_cast<double>(stored_size(image.type));
    if (count * bytes > 9e18)
        fail<InputError>(image.files[0], "the header claims {:.0f} volumes of {:.0f} bytes", count, bytes);
    image.volumes = static_cast<std::int64_t>(count);
    image.volume = volume.value_or(0);
    if (!image.interleaved) image.data_offset += image.volume * static_cast<std::int64_t>(bytes);
}

Volume load_raw(const RawImage& image, const Progress& progress) {
    const std::uint64_t file_bytes = checked_file_bytes(image);
    Volume volume(image.geometry, loaded_type(image));
    volume.set_rescale(image.kept);
    const std::size_t place_bytes = samples_at_a_place(image) * stored_size(image.type);
    const std::size_t in_file = checked_size(file_bytes / place_bytes);
    const std::size_t kept_in_file = in_file * sample_size(volume.type());
    auto* out = static_cast<std::byte*>(volume.data());
    // What is compressed is read also where it is only passed over.
    const auto offset = static_cast<std::uint64_t>(image.data_offset);
    const std::uint64_t total = image.files.size() * (file_bytes + (image.compressed ? offset : 0));
    std::uint64_t done = 0;
    const auto advance = [&](std::size_t bytes) {
        done += bytes;
        internal::report_progress(progress, static_cast<double>(done) / static_cast<double>(total));
    };
    internal::report_progress(progress, 0);
    for (const auto& path : image.files) {
        ByteStream stream(path, image.compressed ? Compression::zlib : Compression::none,
                          data_begin(image, path, file_bytes));
        stream.skip(offset, advance);
        read_samples(stream, image, in_file, out, [&](std::size_t n) { advance(n * place_bytes); });
        out += kept_in_file;
        stream.verify_end();
    }
    return volume;
}

SliceSource raw_slices(const RawImage& image) {
    if (image.compressed) {
        fail<InputError>(
            image.files[0],
            "is compressed and cannot be read slice by slice; decompress it, or read it as a whole");
    }
    const std::uint64_t file_bytes = checked_file_bytes(image);
    const auto read = [image, file_bytes](std::int64_t z_begin, std::int64_t z_end, void* to) {
        const std::size_t place_bytes = samples_at_a_place(image) * stored_size(image.type);
        const std::size_t kept = sample_size(loaded_type(image));
        const auto area = static_cast<std::uint64_t>(image.geometry.dims[0] * image.geometry.dims[1]);
        const std::uint64_t in_file = file_bytes / place_bytes;
        auto* out = static_cast<std::byte*>(to);
        std::uint64_t at = static_cast<std::uint64_t>(z_begin) * area;
        for (const std::uint64_t end = static_cast<std::uint64_t>(z_end) * area; at < end;) {
            const auto& path = image.files[static_cast<std::size_t>(at / in_file)];
            const std::uint64_t first = at % in_file;
            const std::size_t count = checked_size(std::min(end - at, in_file - first), kept);
            ByteStream stream(path, Compression::none,
                              data_begin(image, path, file_bytes) +
                                  static_cast<std::uint64_t>(image.data_offset) + first * place_bytes);
            read_samples(stream, image, count, out, [](std::size_t) {});
            out += count * kept;
            at += count;
        }
    };
    return {.geometry = image.geometry, .type = loaded_type(image), .read = read, .rescale = image.kept};
}

}  // namespace marrow::internal::io
