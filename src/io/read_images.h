// Pictures as volumes: TIFF files of several pages, and folders of slices.
#pragma once

#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

#include <marrow/scan_io.h>

namespace marrow {

/// True for the content of a PNG, TIFF, JPEG or BMP file, known by its first bytes.
bool is_picture(std::string_view head);
bool is_tiff(std::string_view head);

/// The order people expect: "2" before "10".
bool natural_less(const std::filesystem::path& a, const std::filesystem::path& b);

/// A volume made of pictures, known from their headers.
struct PictureStack {
    std::vector<std::filesystem::path> files;  ///< one file of several pages, or one file per slice
    Geometry geometry;                         ///< spacing 1 unless given
    SampleType type = SampleType::uint8;
};

/// Reads the headers. \throw IoError; InputError for colour, or for slices that differ in size or type.
PictureStack read_picture_headers(std::vector<std::filesystem::path> files, const ScanOptions& options);

/// Reads the samples. \throw IoError, InputError, Cancelled.
Volume load_pictures(const PictureStack& stack, const ScanOptions& options);

}  // namespace marrow
