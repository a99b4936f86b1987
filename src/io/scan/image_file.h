// Grey pictures, be it in three equal channels: PNG, TIFF, JPEG, BMP, decoded by libpng, libtiff and libjpeg with errors as exceptions.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

#include <marrow/volume.h>

#include "parallel_slices.h"

namespace marrow {

/// True for the content of a PNG, TIFF, JPEG or BMP file, known by its first bytes.
bool is_picture(std::string_view head);
bool is_tiff(std::string_view head);

struct Picture {
    std::int64_t columns = 0, rows = 0;
    std::int64_t pages = 1;  ///< of a TIFF file; all alike
    SampleType type = SampleType::uint8;

    friend bool operator==(const Picture&, const Picture&) = default;
};

/// \throw IoError; InputError where it is damaged, of a kind that is not read, or claims more than it can hold.
Picture read_picture_header(const std::filesystem::path& path);

/// Reads the samples of a picture whose header is `expected` still: columns fastest, then rows from the top, then pages, as
/// they are stored; of three equal channels one. False where the header is another, `to` being of no use then.
/// \throw as read_picture_header; InputError where it is truncated, or in colour; Cancelled.
bool read_picture(const std::filesystem::path& path, const Picture& expected, void* to, const Step& step);

}  // namespace marrow
