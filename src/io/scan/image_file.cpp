#include "image_file.h"

#include <fmt/format.h>
#include <png.h>
#include <tiffio.h>

#include <algorithm>
#include <array>
#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <limits>
#include <memory>
#include <vector>

#include <jpeglib.h>

#include <marrow/error.h>

#include "io/bytes/byte_stream.h"
#include "io/bytes/text.h"

namespace marrow {

namespace {

using Bytes = std::vector<unsigned char>;

Bytes content(const std::filesystem::path& path) {
    Bytes out(size_of_file(path));
    ByteStream(path, Compression::none).read(out.data(), out.size());
    return out;
}

struct Unreadable {
    std::string why;
};
const Unreadable damaged{"the picture is damaged or truncated"};
const Unreadable in_colour{"is in colour; only grey pictures are read, convert it first"};
const Unreadable transparent{"is transparent in places; save it without transparency"};
const Unreadable odd_samples{"has samples that are not read; save it in grey with 8 or 16 bits"};

// Where samples go, and of which picture; nowhere, where only the header is asked for.
struct Target {
    const Picture* expected = nullptr;
    void* to = nullptr;
    const Step* step = nullptr;  // for pages; other pictures are one step

    // A file that changed since its header was read must not be written past its room.
    bool takes(const Picture& header) const { return to && header == *expected; }
    unsigned char* bytes() const { return static_cast<unsigned char*>(to); }
};

// Many programs save grey pictures with three equal channels. An even number of channels ends with opacity.
template <class T>
void keep_grey(const T* from, std::size_t count, int channels, T* to) {
    for (std::size_t i = 0; i < count; ++i, from += channels) {
        if (channels >= 3 && (from[1] != from[0] || from[2] != from[0])) throw in_colour;
        if (channels % 2 == 0 && from[channels - 1] != std::numeric_limits<T>::max()) throw transparent;
        to[i] = from[0];
    }
}

void keep_grey(const Bytes& from, std::size_t count, int channels, SampleType type, unsigned char* to) {
    if (type == SampleType::uint8)
        keep_grey(from.data(), count, channels, to);
    else
        keep_grey(reinterpret_cast<const std::uint16_t*>(from.data()), count, channels,
                  reinterpret_cast<std::uint16_t*>(to));
}

// --- PNG. libpng reports errors by longjmp: what stands between setjmp and its calls has no destructors.

struct PngSource {
    const unsigned char* at;
    const unsigned char* end;
};

void png_take(png_structp png, png_bytep to, png_size_t count) {
    auto* source = static_cast<PngSource*>(png_get_io_ptr(png));
    if (static_cast<png_size_t>(source->end - source->at) < count) png_error(png, "truncated");
    std::memcpy(to, source->at, count);
    source->at += count;
}
void png_fail(png_structp png, png_const_charp) {
    png_longjmp(png, 1);
}
void png_ignore(png_structp, png_const_charp) {}

struct PngHeader {
    png_uint_32 columns, rows;
    int depth, colour, interlace, channels;
};

bool png_header(png_structp png, png_infop info, PngHeader* out) {
    if (setjmp(png_jmpbuf(png))) return false;
    png_read_info(png, info);
    png_get_IHDR(png, info, &out->columns, &out->rows, &out->depth, &out->colour, &out->interlace, nullptr,
                 nullptr);
    out->channels = png_get_channels(png, info);
    return true;
}

bool png_samples(png_structp png, png_infop info, const PngHeader* header, unsigned char* to,
                 std::size_t line) {
    if (setjmp(png_jmpbuf(png))) return false;
    if (header->depth == 16) png_set_swap(png);  // the file is big-endian
    const int passes = png_set_interlace_handling(png);
    for (int pass = 0; pass < passes; ++pass) {
        for (png_uint_32 row = 0; row < header->rows; ++row) png_read_row(png, to + row * line, nullptr);
    }
    png_read_end(png, info);
    return true;
}

Picture read_png(const std::filesystem::path& path, const Target& target) {
    const Bytes bytes = content(path);
    PngSource source{bytes.data(), bytes.data() + bytes.size()};
    struct Reader {
        png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, png_fail, png_ignore);
        png_infop info = png ? png_create_info_struct(png) : nullptr;
        ~Reader() { png_destroy_read_struct(&png, &info, nullptr); }
    } reader;
    if (!reader.info) throw LimitError("libpng: no memory");
    png_set_read_fn(reader.png, &source, png_take);
    PngHeader header{};
    if (!png_header(reader.png, reader.info, &header)) throw damaged;
    if (header.colour == PNG_COLOR_TYPE_PALETTE) throw in_colour;
    if (header.depth != 8 && header.depth != 16) throw odd_samples;
    const Picture out{header.columns, header.rows, 1,
                      header.depth == 8 ? SampleType::uint8 : SampleType::uint16};
    if (!target.takes(out)) return out;
    const std::size_t line = header.columns * static_cast<std::size_t>(header.channels) *
                             static_cast<std::size_t>(header.depth / 8);
    Bytes pixels(header.channels > 1 ? line * header.rows : 0);
    if (!png_samples(reader.png, reader.info, &header, pixels.empty() ? target.bytes() : pixels.data(), line))
        throw damaged;
    if (!pixels.empty())
        keep_grey(pixels, std::size_t{header.columns} * header.rows, header.channels, out.type,
                  target.bytes());
    return out;
}

// --- JPEG, in the same way

struct JpegErrors {
    jpeg_error_mgr base;
    std::jmp_buf out;
};

void jpeg_fail(j_common_ptr jpeg) {
    std::longjmp(reinterpret_cast<JpegErrors*>(jpeg->err)->out, 1);
}
void jpeg_ignore(j_common_ptr) {}

bool jpeg_header(jpeg_decompress_struct* jpeg, JpegErrors* errors, const unsigned char* bytes,
                 std::size_t size) {
    if (setjmp(errors->out)) return false;
    jpeg_mem_src(jpeg, bytes, static_cast<unsigned long>(size));
    jpeg_read_header(jpeg, TRUE);
    return true;
}

bool jpeg_samples(jpeg_decompress_struct* jpeg, JpegErrors* errors, unsigned char* to) {
    if (setjmp(errors->out)) return false;
    jpeg_start_decompress(jpeg);
    const std::size_t line =
        std::size_t{jpeg->output_width} * static_cast<std::size_t>(jpeg->output_components);
    while (jpeg->output_scanline < jpeg->output_height) {
        JSAMPROW row = to + jpeg->output_scanline * line;
        jpeg_read_scanlines(jpeg, &row, 1);
    }
    jpeg_finish_decompress(jpeg);
    return errors->base.num_warnings == 0;  // libjpeg fills up truncated pictures and only warns
}

Picture read_jpeg(const std::filesystem::path& path, const Target& target) {
    const Bytes bytes = content(path);
    JpegErrors errors{};
    struct Decompress : jpeg_decompress_struct {
        Decompress() : jpeg_decompress_struct{} {}
        ~Decompress() { jpeg_destroy_decompress(this); }
    } jpeg;
    jpeg.err = jpeg_std_error(&errors.base);
    errors.base.error_exit = jpeg_fail;
    errors.base.output_message = jpeg_ignore;
    jpeg_create_decompress(&jpeg);
    if (!jpeg_header(&jpeg, &errors, bytes.data(), bytes.size())) throw damaged;
    if (jpeg.num_components != 1 && jpeg.out_color_space != JCS_RGB) throw in_colour;
    const Picture out{jpeg.image_width, jpeg.image_height, 1, SampleType::uint8};
    if (!target.takes(out)) return out;
    const std::size_t area = std::size_t{jpeg.image_width} * jpeg.image_height;
    Bytes pixels(jpeg.num_components > 1 ? 3 * area : 0);
    if (!jpeg_samples(&jpeg, &errors, pixels.empty() ? target.bytes() : pixels.data())) throw damaged;
    if (!pixels.empty()) keep_grey(pixels, area, 3, out.type, target.bytes());
    return out;
}

// --- TIFF

// A file for libtiff, which takes some failures to read for the end of the file.
class TiffFile {
  public:
    explicit TiffFile(const std::filesystem::path& path)
        : stream_(path, Compression::none), size_(size_of_file(path)) {}

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

int tiff_ignore(TIFF*, void*, const char*, const char*, va_list) {
    return 1;
}  // 1: go no further, to stderr

struct TiffSamples {
    SampleType type;
    int channels;
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
    const bool perhaps_grey = photometric == PHOTOMETRIC_RGB && (channels == 3 || channels == 4) &&
                              planes == PLANARCONFIG_CONTIG && format == SAMPLEFORMAT_UINT &&
                              (bits == 8 || bits == 16);
    if (!grey && !perhaps_grey) throw in_colour;
    if (format == SAMPLEFORMAT_UINT && bits == 8) return {SampleType::uint8, channels};
    if (format == SAMPLEFORMAT_UINT && bits == 16) return {SampleType::uint16, channels};
    if (format == SAMPLEFORMAT_INT && bits == 8) return {SampleType::int8, 1};
    if (format == SAMPLEFORMAT_INT && bits == 16) return {SampleType::int16, 1};
    if (format == SAMPLEFORMAT_INT && bits == 32) return {SampleType::int32, 1};
    if (format == SAMPLEFORMAT_IEEEFP && bits == 32) return {SampleType::float32, 1};
    if (format == SAMPLEFORMAT_IEEEFP && bits == 64) return {SampleType::float64, 1};
    throw odd_samples;
}

// The tiles at the right and lower edge reach beyond the picture.
void read_tiles(TIFF* tiff, std::uint32_t columns, std::uint32_t rows, std::size_t pixel, unsigned char* to) {
    std::uint32_t width = 0, height = 0;
    TIFFGetField(tiff, TIFFTAG_TILEWIDTH, &width);
    TIFFGetField(tiff, TIFFTAG_TILELENGTH, &height);
    const std::uint64_t size = TIFFTileSize64(tiff);
    constexpr std::uint64_t largest = std::uint64_t{1} << 28;
    if (width == 0 || height == 0 || size > largest || size != std::uint64_t{width} * height * pixel)
        throw damaged;
    Bytes tile(size);
    for (std::uint32_t top = 0; top < rows; top += std::min(height, rows - top)) {
        for (std::uint32_t left = 0; left < columns; left += std::min(width, columns - left)) {
            const auto got = TIFFReadEncodedTile(tiff, TIFFComputeTile(tiff, left, top, 0, 0), tile.data(),
                                                 static_cast<tmsize_t>(size));
            if (got != static_cast<tmsize_t>(size)) throw damaged;
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
    if (static_cast<std::size_t>(TIFFScanlineSize64(tiff)) != line) throw damaged;
    for (std::uint32_t row = 0; row < rows; ++row) {
        if (TIFFReadScanline(tiff, to + row * line, row) != 1) throw damaged;
    }
}

Picture read_tiff_pages(TiffFile& file, const Target& target) {
    const std::unique_ptr<TIFFOpenOptions, void (*)(TIFFOpenOptions*)> options(TIFFOpenOptionsAlloc(),
                                                                               TIFFOpenOptionsFree);
    if (!options) throw LimitError("libtiff: no memory");
    TIFFOpenOptionsSetErrorHandlerExtR(options.get(), tiff_ignore, nullptr);
    TIFFOpenOptionsSetWarningHandlerExtR(options.get(), tiff_ignore, nullptr);
    // m: read it; a mapped file that shrinks meanwhile would end the process
    const std::unique_ptr<TIFF, void (*)(TIFF*)> tiff(
        TIFFClientOpenExt("", "rm", &file, TiffFile::read, TiffFile::write, TiffFile::seek, TiffFile::close,
                          TiffFile::size, nullptr, nullptr, options.get()),
        TIFFClose);
    if (!tiff) throw damaged;

    Picture out;
    for (out.pages = 0; out.pages == 0 || TIFFReadDirectory(tiff.get()); ++out.pages) {
        std::uint32_t columns = 0, rows = 0;
        TIFFGetField(tiff.get(), TIFFTAG_IMAGEWIDTH, &columns);
        TIFFGetField(tiff.get(), TIFFTAG_IMAGELENGTH, &rows);
        const auto [type, channels] = tiff_samples(tiff.get());
        if (out.pages == 0) {
            out.columns = columns;
            out.rows = rows;
            out.type = type;
        } else if (out.columns != columns || out.rows != rows || out.type != type) {
            throw Unreadable{"has pages that differ in size or sample type"};
        }
        Picture known = out;  // of the pages, one is known so far
        if (target.to) known.pages = target.expected->pages;
        if (target.takes(known) && out.pages < known.pages) {
            const std::size_t area = std::size_t{columns} * rows, sample = sample_size(type);
            unsigned char* page = target.bytes() + static_cast<std::size_t>(out.pages) * area * sample;
            const std::size_t pixel = sample * static_cast<std::size_t>(channels);
            Bytes pixels(channels > 1 ? area * pixel : 0);
            (TIFFIsTiled(tiff.get()) ? read_tiles : read_strips)(tiff.get(), columns, rows, pixel,
                                                                 pixels.empty() ? page : pixels.data());
            if (!pixels.empty()) keep_grey(pixels, area, channels, type, page);
            (*target.step)(1 / static_cast<double>(known.pages));
        }
        if (TIFFLastDirectory(tiff.get())) return ++out.pages, out;
    }
    throw damaged;  // a page is announced that is not there
}

Picture read_tiff(const std::filesystem::path& path, const Target& target) {
    TiffFile file(path);
    try {
        const Picture out = read_tiff_pages(file, target);
        file.check();
        return out;
    } catch (const Unreadable&) {
        file.check();
        throw;
    }
}

// --- BMP: 8 bits with a grey palette or 24 or 32 in equal channels, not compressed

Picture read_bmp(const std::filesystem::path& path, const Target& target) {
    const Bytes bytes = content(path);
    const auto at = [&](std::size_t offset, std::size_t size) {
        if (bytes.size() < offset + size) throw damaged;
        std::uint32_t out = 0;
        for (std::size_t i = 0; i < size; ++i)
            out |= static_cast<std::uint32_t>(bytes[offset + i]) << (8 * i);
        return out;
    };
    const std::size_t data = at(10, 4), header = at(14, 4);
    if (header < 40 || header > 200) throw Unreadable{"is a kind of BMP that is not read"};
    const auto columns = static_cast<std::int32_t>(at(18, 4)), rows = static_cast<std::int32_t>(at(22, 4));
    const std::uint32_t bits = at(28, 2), compression = at(30, 4), used = at(46, 4);
    if ((bits != 8 && bits != 24 && bits != 32) || compression != 0 || used > 256) throw odd_samples;
    if (columns <= 0 || rows == 0 || rows == INT32_MIN) throw damaged;
    const auto grey_of = [](std::uint32_t colour) {
        if ((colour & 0xff) != (colour >> 8 & 0xff) || (colour & 0xff) != (colour >> 16 & 0xff))
            throw in_colour;
        return static_cast<unsigned char>(colour);
    };
    std::array<unsigned char, 256> palette{};
    for (std::size_t i = 0; bits == 8 && i < (used ? used : 256); ++i)
        palette[i] = grey_of(at(14 + header + 4 * i, 4));
    const std::size_t height = static_cast<std::size_t>(rows > 0 ? rows : -static_cast<std::int64_t>(rows));
    const std::size_t width = static_cast<std::size_t>(columns), pixel = bits / 8;
    const std::size_t line = (width * pixel + 3) / 4 * 4;
    if (data > bytes.size() || (bytes.size() - data) / line < height) throw damaged;
    const Picture out{columns, static_cast<std::int64_t>(height), 1, SampleType::uint8};
    if (!target.takes(out)) return out;
    for (std::size_t row = 0; row < height; ++row) {
        // upside down unless the height is negative
        const std::size_t from = data + (rows > 0 ? height - 1 - row : row) * line;
        for (std::size_t i = 0; i < width; ++i)
            target.bytes()[row * width + i] =
                pixel == 1 ? palette[bytes[from + i]] : grey_of(at(from + i * pixel, 3));
    }
    return out;
}

bool is_png(std::string_view head) {
    return head.starts_with("\x89PNG\r\n\x1a\n");
}
bool is_jpeg(std::string_view head) {
    return head.starts_with("\xff\xd8\xff");
}
bool is_bmp(std::string_view head) {
    using namespace std::string_view_literals;
    return head.starts_with("BM") && head.size() >= 10 && head.substr(6, 4) == "\0\0\0\0"sv;
}

}  // namespace

bool is_tiff(std::string_view head) {
    using namespace std::string_view_literals;
    return head.starts_with("II*\0"sv) || head.starts_with("MM\0*"sv) || head.starts_with("II+\0"sv) ||
           head.starts_with("MM\0+"sv);
}

bool is_picture(std::string_view head) {
    return is_png(head) || is_tiff(head) || is_jpeg(head) || is_bmp(head);
}

namespace {

Picture read_picture(const std::filesystem::path& path, const Target& target) {
    const std::string head = head_of(path, 16);
    try {
        Picture out;
        if (is_png(head))
            out = read_png(path, target);
        else if (is_tiff(head))
            out = read_tiff(path, target);
        else if (is_jpeg(head))
            out = read_jpeg(path, target);
        else if (is_bmp(head))
            out = read_bmp(path, target);
        else
            throw Unreadable{"is not a PNG, TIFF, JPEG or BMP picture"};
        // no compression that is read here makes more than 2000 bytes of one
        if (static_cast<double>(out.columns) * static_cast<double>(out.rows) *
                static_cast<double>(out.pages) * static_cast<double>(sample_size(out.type)) >
            2000.0 * static_cast<double>(size_of_file(path))) {
            throw Unreadable{"claims more samples than it can hold"};
        }
        return out;
    } catch (const Unreadable& error) {
        throw InputError(fmt::format("{}: {}", shown(path), error.why));
    } catch (const std::bad_alloc&) {
        throw LimitError(fmt::format("{}: the picture does not fit in memory", shown(path)));
    }
}

}  // namespace

Picture read_picture_header(const std::filesystem::path& path) {
    return read_picture(path, {});
}

bool read_picture(const std::filesystem::path& path, const Picture& expected, void* to, const Step& step) {
    bool paged = false;
    const Step page = [&](double part) {
        paged = true;
        step(part);
    };
    if (read_picture(path, {&expected, to, &page}) != expected) return false;
    if (!paged) step(1);
    return true;
}

}  // namespace marrow
