// The codecs of images, in the module that does without them. What needs them fails, and is done again by the
// other module, which is loaded then.
#include <marrow/error.h>

#include "io/dicom/grey_jpeg.h"
#include "io/dicom/jpeg2000.h"
#include "io/dicom/jpeg_ls.h"
#include "io/scan/image_decoders.h"
#include "needed.h"

namespace marrow::internal::io {
namespace {

template <class Fault>
[[noreturn]] void fail_without_codecs() {
    web::need_codecs();
    throw Fault{"needs a codec that is not loaded"};
}

}  // namespace

DecodedFrame decode_grey_jpeg(std::string_view, std::int64_t, std::int64_t) {
    fail_without_codecs<InputError>();
}

DecodedFrame decode_jpeg_ls(std::string_view, std::int64_t, std::int64_t) {
    fail_without_codecs<InputError>();
}

DecodedFrame decode_jpeg2000(std::string_view, std::int64_t, std::int64_t) {
    fail_without_codecs<InputError>();
}

bool decodes_high_throughput() {
    return false;  // nor does the OpenJPEG of the other module
}

ImageHeader read_png(const std::filesystem::path&, const ImageTarget&) {
    fail_without_codecs<UnreadableImage>();
}

ImageHeader read_jpeg(const std::filesystem::path&, const ImageTarget&) {
    fail_without_codecs<UnreadableImage>();
}

ImageHeader read_tiff(const std::filesystem::path&, const ImageTarget&) {
    fail_without_codecs<UnreadableImage>();
}

}  // namespace marrow::internal::io
