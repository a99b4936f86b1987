// Decodes JPEG-LS by DCMTK's form of CharLS.
#include "io/dicom/jpeg_ls.h"

#include <dcmtkcharls/intrface.h>

#include <limits>
#include <string>

#include <marrow/error.h>

namespace marrow::internal::io {

DecodedFrame decode_jpeg_ls(std::string_view stream, std::int64_t columns, std::int64_t rows) {
    const InputError damaged("its JPEG-LS pixels are damaged or truncated");
    // CharLS looks for the end of a scan in what follows.
    const std::string bounded = std::string(stream) + "\xff\xd9";
    JlsParameters info{};
    if (JpegLsReadHeader(bounded.data(), bounded.size(), &info) != OK) throw damaged;
    check_size(info.width, info.height, info.components, info.bitspersample, columns, rows);
    DecodedFrame out{{}, info.bitspersample <= 8 ? 1 : 2, info.bitspersample};
    out.cells.resize(static_cast<std::size_t>(columns * rows * out.cell_size));
    info.bytesperline = info.width * out.cell_size;
    if (JpegLsDecode(out.cells.data(), out.cells.size(), bounded.data(), bounded.size(), &info) != OK)
        throw damaged;
    return out;
}

}  // namespace marrow::internal::io
