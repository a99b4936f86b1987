// Reads JPEG images. libjpeg reports errors by longjmp, so functions with setjmp create no objects with
// destructors.
#include "image_decoders.h"

#include <csetjmp>
#include <cstdio>

#include <jpeglib.h>

#include <marrow/error.h>

namespace marrow::internal::io {

namespace {

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
    return errors->base.num_warnings == 0;  // libjpeg completes truncated images and only warns
}

}  // namespace

ImageHeader read_jpeg(const std::filesystem::path& path, const ImageTarget& target) {
    const Bytes bytes = file_bytes(path);
    JpegErrors errors{};
    struct Decompress : jpeg_decompress_struct {
        Decompress() : jpeg_decompress_struct{} {}
        ~Decompress() { jpeg_destroy_decompress(this); }
    } jpeg;
    jpeg.err = jpeg_std_error(&errors.base);
    errors.base.error_exit = jpeg_fail;
    errors.base.output_message = jpeg_ignore;
    jpeg_create_decompress(&jpeg);
    if (!jpeg_header(&jpeg, &errors, bytes.data(), bytes.size())) throw kDamaged;
    if (jpeg.num_components != 1 && jpeg.out_color_space != JCS_RGB) throw kInColour;
    const ImageHeader out{jpeg.image_width, jpeg.image_height, 1, SampleType::uint8};
    if (!target.takes(out)) return out;
    const std::size_t area = std::size_t{jpeg.image_width} * jpeg.image_height;
    Bytes pixels(jpeg.num_components > 1 ? 3 * area : 0);
    if (!jpeg_samples(&jpeg, &errors, pixels.empty() ? target.bytes() : pixels.data())) throw kDamaged;
    if (!pixels.empty()) keep_grey(pixels, area, 3, out.type, target.bytes());
    return out;
}

}  // namespace marrow::internal::io
