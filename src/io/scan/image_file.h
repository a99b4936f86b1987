/// Reads grey images, also those saved with equal colour channels: PNG, TIFF, JPEG and BMP.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

#include <marrow/volume.h>

#include "parallel_slices.h"

namespace marrow::internal::io {

/// Whether a file with these first bytes is a PNG, TIFF, JPEG or BMP file.
bool is_image_file(std::string_view head);
bool is_tiff(std::string_view head);

struct ImageHeader {
    std::int64_t columns = 0, rows = 0;
    std::int64_t pages = 1;  ///< of a TIFF file; they have the same size and type
    SampleType type = SampleType::uint8;

    friend bool operator==(const ImageHeader&, const ImageHeader&) = default;
};

/// \throw IoError; InputError the image is damaged, of an unsupported kind, or claims more than it can hold
ImageHeader read_image_header(const std::filesystem::path& path);

/// Reads the samples: columns fastest, then rows from the top, then pages. If the header is not `expected`,
/// it returns false and the samples are undefined.
/// \throw the errors of read_image_header; InputError the image is truncated or in colour; Cancelled
bool read_image(const std::filesystem::path& path, const ImageHeader& expected, void* to, const Step& step);

}  // namespace marrow::internal::io
