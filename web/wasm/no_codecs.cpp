// Stands for the codecs in the module without them. JavaScript then loads the module that has them, and starts again.
#include "io/dicom/grey_jpeg.h"
#include "io/dicom/jpeg2000.h"
#include "io/dicom/jpeg_ls.h"
#include "io/scan/image_decoders.h"
#include "needs_codecs.h"

namespace marrow::internal::io {

DecodedFrame decode_grey_jpeg(std::string_view, std::int64_t, std::int64_t) {
    throw web::NeedsCodecs();
}

DecodedFrame decode_jpeg_ls(std::string_view, std::int64_t, std::int64_t) {
    throw web::NeedsCodecs();
}

DecodedFrame decode_jpeg2000(std::string_view, std::int64_t, std::int64_t) {
    throw web::NeedsCodecs();
}

bool decodes_high_throughput() {
    return false;  // as the OpenJPEG of the module with codecs
}

ImageHeader read_png(const std::filesystem::path&, const ImageTarget&) {
    throw web::NeedsCodecs();
}

ImageHeader read_jpeg(const std::filesystem::path&, const ImageTarget&) {
    throw web::NeedsCodecs();
}

ImageHeader read_tiff(const std::filesystem::path&, const ImageTarget&) {
    throw web::NeedsCodecs();
}

}  // namespace marrow::internal::io
