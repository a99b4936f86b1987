// The codecs that browsers are not given.
#include <marrow/error.h>

#include "io/dicom/grey_jpeg.h"
#include "io/dicom/jpeg2000.h"
#include "io/dicom/jpeg_ls.h"
#include "io/scan/image_decoders.h"

namespace marrow::internal::io {

DecodedFrame decode_grey_jpeg(std::string_view, std::int64_t, std::int64_t) {
    throw InputError(
        "its pixels are JPEG, which is not read in browsers; decompress it first, as by dcmdjpeg");
}

DecodedFrame decode_jpeg_ls(std::string_view, std::int64_t, std::int64_t) {
    throw InputError(
        "its pixels are JPEG-LS, which is not read in browsers; decompress it first, as by dcmdjpls");
}

DecodedFrame decode_jpeg2000(std::string_view, std::int64_t, std::int64_t) {
    throw InputError(
        "its pixels are JPEG 2000, which is not read in browsers; decompress it first, as by gdcmconv --raw");
}

bool decodes_high_throughput() {
    return false;
}

ImageHeader read_png(const std::filesystem::path&, const ImageTarget&) {
    throw UnreadableImage{"is a PNG image, which is not read in browsers; convert the slices to NRRD"};
}

ImageHeader read_jpeg(const std::filesystem::path&, const ImageTarget&) {
    throw UnreadableImage{"is a JPEG image, which is not read in browsers; convert the slices to NRRD"};
}

ImageHeader read_tiff(const std::filesystem::path&, const ImageTarget&) {
    throw UnreadableImage{"is a TIFF image, which is not read in browsers; convert it to NRRD"};
}

}  // namespace marrow::internal::io
