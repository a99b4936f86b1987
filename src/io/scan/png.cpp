// Reads PNG images. libpng reports errors by longjmp, so functions with setjmp create no objects with
// destructors.
#include "image_decoders.h"

#include <png.h>

#include <cstring>

#include <marrow/error.h>

#include "base/checked_size.h"

namespace marrow::internal::io {

namespace {

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

}  // namespace

ImageHeader read_png(const std::filesystem::path& path, const ImageTarget& target) {
    const Bytes bytes = file_bytes(path);
    PngSource source{bytes.data(), bytes.data() + bytes.size()};
    struct Reader {
        png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, png_fail, png_ignore);
        png_infop info = png ? png_create_info_struct(png) : nullptr;
        ~Reader() { png_destroy_read_struct(&png, &info, nullptr); }
    } reader;
    if (!reader.info) throw LimitError("not enough memory for libpng");
    png_set_read_fn(reader.png, &source, png_take);
    PngHeader header{};
    if (!png_header(reader.png, reader.info, &header)) throw kDamaged;
    if (header.colour == PNG_COLOR_TYPE_PALETTE) throw kInColour;
    if (header.depth != 8 && header.depth != 16) throw kOddSamples;
    const ImageHeader out{header.columns, header.rows, 1,
                          header.depth == 8 ? SampleType::uint8 : SampleType::uint16};
    if (!target.takes(out)) return out;
    const std::uint64_t line = std::uint64_t{header.columns} * static_cast<std::uint64_t>(header.channels) *
                               static_cast<std::uint64_t>(header.depth / 8);
    Bytes pixels(header.channels > 1 ? checked_size(header.rows * line) : 0);
    if (!png_samples(reader.png, reader.info, &header, pixels.empty() ? target.bytes() : pixels.data(),
                     checked_size(line)))
        throw kDamaged;
    if (!pixels.empty())
        keep_grey(pixels, std::size_t{header.columns} * header.rows, header.channels, out.type,
                  target.bytes());
    return out;
}

}  // namespace marrow::internal::io
