// Reads TIFF images with one or more pages.
#include "image_decoders.h"

#include <tiffio.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include <marrow/error.h>

#include "base/checked_size.h"
#include "io/bytes/byte_stream.h"
#include "io/bytes/stored_samples.h"
#include "io/bytes/text.h"

namespace marrow::internal::io {

namespace {

// A file for libtiff. It remembers read errors, because libtiff mistakes some of them for the end of the
// file.
class TiffFile {
  public:
    explicit TiffFile(const std::filesystem::path& path)
        : stream_(path, Compression::none), size_(regular_file_size(path)) {}

    void check() const {
        if (!failure_.empty()) throw IoError(failure_);
    }

    static tmsize_t read(thandle_t self, void* to, tmsize_t size) {
        auto& file = *static_cast<TiffFile*>(self);
        try {
            file.stream_.seek(file.at_);
            const std::size_t got = file.stream_.read_some(to, static_cast<std::size_t>(size));
            file.at_ += got;
            return static_cast<tmsize_t>(got);
        } catch (const Error& error) {
            file.failure_ = error.what();
            return -1;
        }
    }
    static tmsize_t write(thandle_t, void*, tmsize_t) { return -1; }
    static toff_t seek(thandle_t self, toff_t to, int from) {
        auto& file = *static_cast<TiffFile*>(self);
        file.at_ = to + (from == SEEK_SET ? 0 : from == SEEK_CUR ? file.at_ : file.size_);
        return file.at_;
    }
    static int close(thandle_t) { return 0; }
    static toff_t size(thandle_t self) { return static_cast<TiffFile*>(self)->size_; }

  private:
    ByteStream stream_;
    std::uint64_t size_, at_ = 0;
    std::string failure_;
};

// Returns 1 so that libtiff does not print the message.
int tiff_ignore(TIFF*, void*, const char*, const char*, va_list) {
    return 1;
}

struct TiffSamples {
    StoredType type;
    int channels;

    std::size_t pixel_size() const { return stored_size(type) * static_cast<std::size_t>(channels); }
};

TiffSamples tiff_samples(TIFF* tiff) {
    std::uint16_t bits = 1, format = SAMPLEFORMAT_UINT, channels = 1, photometric = PHOTOMETRIC_MINISBLACK,
                  planes = PLANARCONFIG_CONTIG;
    TIFFGetFieldDefaulted(tiff, TIFFTAG_BITSPERSAMPLE, &bits);
    TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLEFORMAT, &format);
    TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLESPERPIXEL, &channels);
    TIFFGetFieldDefaulted(tiff, TIFFTAG_PHOTOMETRIC, &photometric);
    TIFFGetFieldDefaulted(tiff, TIFFTAG_PLANARCONFIG, &planes);
    const bool grey =
        channels == 1 && (photometric == PHOTOMETRIC_MINISBLACK || photometric == PHOTOMETRIC_MINISWHITE);
    // Colours may all be grey, and the second channel of grey is how opaque it is.
    const bool has_colours = photometric == PHOTOMETRIC_RGB && (channels == 3 || channels == 4),
               has_opacity = photometric == PHOTOMETRIC_MINISBLACK && channels == 2;
    const bool perhaps_grey = (has_colours || has_opacity) && planes == PLANARCONFIG_CONTIG &&
                              format == SAMPLEFORMAT_UINT && (bits == 8 || bits == 16);
    if (!grey && !perhaps_grey) throw kInColour;
    if (format == SAMPLEFORMAT_UINT && bits == 8) return {StoredType::uint8, channels};
    if (format == SAMPLEFORMAT_UINT && bits == 16) return {StoredType::uint16, channels};
    if (format == SAMPLEFORMAT_UINT && bits == 32) return {StoredType::uint32, 1};
    if (format == SAMPLEFORMAT_UINT && bits == 64) return {StoredType::uint64, 1};
    if (format == SAMPLEFORMAT_INT && bits == 8) return {StoredType::int8, 1};
    if (format == SAMPLEFORMAT_INT && bits == 16) return {StoredType::int16, 1};
    if (format == SAMPLEFORMAT_INT && bits == 32) return {StoredType::int32, 1};
    if (format == SAMPLEFORMAT_INT && bits == 64) return {StoredType::int64, 1};
    if (format == SAMPLEFORMAT_IEEEFP && bits == 32) return {StoredType::float32, 1};
    if (format == SAMPLEFORMAT_IEEEFP && bits == 64) return {StoredType::float64, 1};
    throw UnreadableImage{
        "has an unsupported sample type; save it in grey as integers of 8 to 64 bits, float32 or float64"};
}

// \throw UnreadableImage a page is a volume, as tifffile writes on request
void check_depth(TIFF* tiff) {
    std::uint32_t depth = 1;
    TIFFGetFieldDefaulted(tiff, TIFFTAG_IMAGEDEPTH, &depth);
    if (depth > 1)
        throw UnreadableImage{fmt::format(
            "holds {} slices in one page (ImageDepth), which is not supported; save each as a page", depth)};
}

// libtiff knows compressions that it may have been built without.
void check_compression(TIFF* tiff) {
    std::uint16_t scheme = COMPRESSION_NONE;
    TIFFGetFieldDefaulted(tiff, TIFFTAG_COMPRESSION, &scheme);
    const TIFFCodec* const codec = TIFFFindCODEC(scheme);
    if (codec == nullptr || TIFFIsCODECConfigured(scheme)) return;
    throw UnreadableImage{std::string("is compressed by ") + codec->name +
                          ", which is not supported; save it uncompressed or compressed by Deflate"};
}

// Whether the first row is the lowest one. \throw UnreadableImage the image is mirrored or turned
bool is_upside_down(TIFF* tiff) {
    std::uint16_t orientation = ORIENTATION_TOPLEFT;
    TIFFGetFieldDefaulted(tiff, TIFFTAG_ORIENTATION, &orientation);
    if (orientation != ORIENTATION_TOPLEFT && orientation != ORIENTATION_BOTLEFT)
        throw UnreadableImage{"is stored mirrored or turned, which is not supported; save it upright"};
    return orientation == ORIENTATION_BOTLEFT;
}

// The tiles at the right and lower edges extend beyond the image.
void read_tiles(TIFF* tiff, std::uint32_t columns, std::uint32_t rows, std::size_t pixel, unsigned char* to) {
    std::uint32_t width = 0, height = 0;
    TIFFGetField(tiff, TIFFTAG_TILEWIDTH, &width);
    TIFFGetField(tiff, TIFFTAG_TILELENGTH, &height);
    const std::uint64_t size = TIFFTileSize64(tiff);
    constexpr std::uint64_t largest = std::uint64_t{1} << 28;
    if (width == 0 || height == 0 || size > largest || size != std::uint64_t{width} * height * pixel)
        throw kDamaged;
    Bytes tile(checked_size(size));
    for (std::uint32_t top = 0; top < rows; top += std::min(height, rows - top)) {
        for (std::uint32_t left = 0; left < columns; left += std::min(width, columns - left)) {
            const auto got = TIFFReadEncodedTile(tiff, TIFFComputeTile(tiff, left, top, 0, 0), tile.data(),
                                                 static_cast<tmsize_t>(size));
            if (got != static_cast<tmsize_t>(size)) throw kDamaged;
            const std::size_t wide = std::min(width, columns - left) * pixel;
            for (std::uint32_t row = 0; row < std::min(height, rows - top); ++row)
                std::memcpy(to + ((top + row) * std::size_t{columns} + left) * pixel,
                            tile.data() + row * std::size_t{width} * pixel, wide);
        }
    }
}

void read_strips(TIFF* tiff, std::uint32_t columns, std::uint32_t rows, std::size_t pixel,
                 unsigned char* to) {
    const std::size_t line = columns * pixel;
    if (static_cast<std::size_t>(TIFFScanlineSize64(tiff)) != line) throw kDamaged;
    for (std::uint32_t row = 0; row < rows; ++row) {
        if (TIFFReadScanline(tiff, to + row * line, row) != 1) throw kDamaged;
    }
}

// What follows a key in a text, to the end of its line; nothing if the key is not there.
std::optional<std::string_view> text_after(std::string_view text, std::string_view key) {
    const std::size_t at = text.find(key);
    if (at == text.npos) return {};
    text.remove_prefix(at + key.size());
    return take_line(text);
}

// The number after a key in a text: 12 for "slices=" in "images=24\nslices=12"; 1 if it is not there.
std::int64_t number_after(std::string_view text, std::string_view key) {
    const std::string_view number = text_after(text, key).value_or("1");
    return parse_integer(number.substr(0, number.find_first_not_of("0123456789"))).value_or(1);
}

// ImageJ and OME describe in the first page what the pages of a file are.
struct Description {
    std::string text;

    explicit Description(TIFF* tiff) {
        char* found = nullptr;
        if (TIFFGetField(tiff, TIFFTAG_IMAGEDESCRIPTION, &found) == 1 && found) text = found;
    }
    bool is_of_imagej() const { return text.starts_with("ImageJ="); }

    // Refuses pages that are slices of several channels or times in turn.
    void check_pages(std::int64_t pages) const {
        const auto number = [&](const char* imagej, const char* ome) {
            return is_of_imagej() ? number_after(text, imagej) : number_after(text, ome);
        };
        if (!is_of_imagej() && text.find("<OME") == text.npos) return;
        const std::int64_t channels = number("\nchannels=", " SizeC=\""),
                           slices = number("\nslices=", " SizeZ=\""),
                           times = number("\nframes=", " SizeT=\"");
        // One that has only channels may be a stack: some programs write slices so.
        if (pages > std::max({channels, slices, times}) && channels * slices * times > 1)
            throw UnreadableImage{"holds several channels or times; save one of them as a stack"};
    }
    // Refuses samples that stand for other values, as ImageJ stores signed integers.
    void check_values() const {
        if (!is_of_imagej()) return;
        const auto offset = text_after(text, "\nc0="), factor = text_after(text, "\nc1=");
        if (parse_double(offset.value_or("0")) == 0.0 && parse_double(factor.value_or("1")) == 1.0) return;
        throw UnreadableImage{
            "stands for other values than it stores (ImageJ's calibration), which is not supported; save it "
            "as NRRD"};
    }
    // Beyond 4 GiB, ImageJ describes only the first of its images, and the others follow it. tifffile does so
    // on request.
    void check_single_page(double page_samples, double sample_bytes, double file_bytes) const {
        const double images = is_of_imagej() ? static_cast<double>(number_after(text, "\nimages="))
                                             : truncated_samples() / page_samples;
        if (images > 1 && images * page_samples * sample_bytes <= file_bytes)
            throw UnreadableImage{fmt::format(
                "describes one of its {:.0f} images, as {}; save it as an image sequence", images,
                is_of_imagej() ? "ImageJ does beyond 4 GiB" : "tifffile does if told to truncate")};
    }

  private:
    // The samples of a file of tifffile that describes only its first page:
    // {"shape": [6, 16, 16], "truncated": true}. 0 if it is none.
    double truncated_samples() const {
        constexpr std::string_view kShape = "{\"shape\": [";
        if (!text.starts_with(kShape) || text.find("\"truncated\": true") == text.npos) return 0;
        std::string_view sizes = std::string_view(text).substr(kShape.size());
        sizes = sizes.substr(0, sizes.find(']'));
        double samples = 1;
        while (!sizes.empty()) {
            const std::size_t end = std::min(sizes.find(','), sizes.size());
            samples *= parse_double(sizes.substr(0, end)).value_or(0);
            sizes.remove_prefix(std::min(end + 1, sizes.size()));
        }
        return samples;
    }
};

// `path` names the file in errors.
ImageHeader read_tiff_pages(TiffFile& file, const std::filesystem::path& path, const ImageTarget& target) {
    const std::unique_ptr<TIFFOpenOptions, void (*)(TIFFOpenOptions*)> options(TIFFOpenOptionsAlloc(),
                                                                               TIFFOpenOptionsFree);
    if (!options) throw LimitError("not enough memory for libtiff");
    TIFFOpenOptionsSetErrorHandlerExtR(options.get(), tiff_ignore, nullptr);
    TIFFOpenOptionsSetWarningHandlerExtR(options.get(), tiff_ignore, nullptr);
    // "m" disables memory mapping: if a mapped file shrinks meanwhile, the process gets SIGBUS.
    const std::unique_ptr<TIFF, void (*)(TIFF*)> tiff(
        TIFFClientOpenExt("", "rm", &file, TiffFile::read, TiffFile::write, TiffFile::seek, TiffFile::close,
                          TiffFile::size, nullptr, nullptr, options.get()),
        TIFFClose);
    if (!tiff) throw kDamaged;

    const Description description(tiff.get());
    ImageHeader out;
    for (out.pages = 0; out.pages == 0 || TIFFReadDirectory(tiff.get()); ++out.pages) {
        std::uint32_t columns = 0, rows = 0;
        TIFFGetField(tiff.get(), TIFFTAG_IMAGEWIDTH, &columns);
        TIFFGetField(tiff.get(), TIFFTAG_IMAGELENGTH, &rows);
        check_compression(tiff.get());
        check_depth(tiff.get());
        const TiffSamples samples = tiff_samples(tiff.get());
        const SampleType type = loaded_type(samples.type, {});
        const bool upside_down = is_upside_down(tiff.get());
        if (out.pages == 0) {
            out.columns = columns;
            out.rows = rows;
            out.type = type;
        } else if (out.columns != columns || out.rows != rows || out.type != type) {
            throw UnreadableImage{"has pages that differ in size or sample type"};
        }
        ImageHeader known = out;  // only one page is known so far
        if (target.to) known.pages = target.expected->pages;
        if (target.takes(known) && out.pages < known.pages) {
            const std::size_t area = std::size_t{columns} * rows, sample = sample_size(type);
            unsigned char* page = target.bytes() + static_cast<std::size_t>(out.pages) * area * sample;
            const std::size_t pixel = samples.pixel_size();
            const bool as_stored = samples.channels == 1 && is_loaded_as_stored(samples.type, {});
            Bytes pixels(as_stored ? 0 : checked_size(area, pixel) * pixel);
            (TIFFIsTiled(tiff.get()) ? read_tiles : read_strips)(tiff.get(), columns, rows, pixel,
                                                                 as_stored ? page : pixels.data());
            if (samples.channels > 1)
                keep_grey(pixels, area, samples.channels, type, page);
            else if (!as_stored)
                load_samples(pixels.data(), page, area, samples.type, {}, path);
            const std::size_t line = columns * sample;
            for (std::uint32_t row = 0; upside_down && row < rows / 2; ++row)
                std::swap_ranges(page + row * line, page + (row + 1) * line, page + (rows - 1 - row) * line);
            (*target.step)(1 / static_cast<double>(known.pages));
        }
        if (TIFFLastDirectory(tiff.get())) {
            ++out.pages;
            description.check_pages(out.pages);
            description.check_values();
            if (out.pages == 1)
                description.check_single_page(static_cast<double>(columns) * rows * samples.channels,
                                              static_cast<double>(stored_size(samples.type)),
                                              static_cast<double>(TiffFile::size(&file)));
            return out;
        }
    }
    throw kDamaged;  // an announced page is missing
}

}  // namespace

ImageHeader read_tiff(const std::filesystem::path& path, const ImageTarget& target) {
    TiffFile file(path);
    try {
        const ImageHeader out = read_tiff_pages(file, path, target);
        file.check();
        return out;
    } catch (const UnreadableImage&) {
        file.check();
        throw;
    }
}

}  // namespace marrow::internal::io
