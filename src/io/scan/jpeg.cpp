// Reads JPEG images by TurboJPEG.
#include "image_decoders.h"

#include <memory>
#include <new>

#include <turbojpeg.h>

#include "base/checked_size.h"

namespace marrow::internal::io {

ImageHeader read_jpeg(const std::filesystem::path& path, const ImageTarget& target) {
    const Bytes bytes = file_bytes(path);
    const std::unique_ptr<void, int (*)(tjhandle)> jpeg(tjInitDecompress(), tjDestroy);
    if (!jpeg) throw std::bad_alloc();
    int columns = 0, rows = 0, sampling = 0, colours = 0;
    if (tjDecompressHeader3(jpeg.get(), bytes.data(), bytes.size(), &columns, &rows, &sampling, &colours) !=
            0 ||
        columns < 1)  // a file of tables alone
        throw kDamaged;
    if (colours != TJCS_GRAY && colours != TJCS_YCbCr && colours != TJCS_RGB) throw kInColour;
    const ImageHeader out{columns, rows, 1, SampleType::uint8};
    if (!target.takes(out)) return out;
    const bool grey = colours == TJCS_GRAY;
    const auto area = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
    Bytes pixels(grey ? 0 : checked_size(area, 3) * 3);
    // It completes truncated images and only warns. An image of many scans takes long.
    constexpr int kStrict = TJFLAG_STOPONWARNING | TJFLAG_LIMITSCANS;
    if (tjDecompress2(jpeg.get(), bytes.data(), bytes.size(), grey ? target.bytes() : pixels.data(), columns,
                      0, rows, grey ? TJPF_GRAY : TJPF_RGB, kStrict) != 0)
        throw kDamaged;
    if (!grey) keep_grey(pixels, area, 3, out.type, target.bytes());
    return out;
}

}  // namespace marrow::internal::io
