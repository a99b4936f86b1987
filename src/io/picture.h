// Grey pictures: PNG, TIFF, JPEG, BMP, decoded by libpng, libtiff and libjpeg with errors as exceptions.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

#include <marrow/volume.h>

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

/// Reads a picture's header and, where `to` is not null, its samples: columns fastest, then rows from the
/// top, then pages, as they are stored. \pre `to` has room for what the header says. \throw IoError;
/// InputError where it is damaged, truncated, in colour, or of a kind that is not read.
Picture read_picture(const std::filesystem::path& path, void* to);

}  // namespace marrow
