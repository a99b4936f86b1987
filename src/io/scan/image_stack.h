// Pictures as volumes: TIFF files of several pages, and folders of slices.
#pragma once

#include <filesystem>
#include <vector>

#include <marrow/scan_io.h>

#include "image_file.h"

namespace marrow {

/// The order people expect: "2" before "10".
bool natural_less(const std::filesystem::path& a, const std::filesystem::path& b);

/// A volume made of pictures: one file of one or more pages, or one file for each slice.
struct PictureStack {
    std::vector<std::filesystem::path> files;
    Picture picture;  ///< what each of them is like
    Geometry geometry;
};

/// Reads the headers, which must be alike. Where options give no spacing it is 1. \throw IoError, InputError, Cancelled.
PictureStack read_picture_headers(std::vector<std::filesystem::path> files, const ScanOptions& options);

/// Reads the samples. \throw IoError; InputError, also for slices in colour; Cancelled.
Volume load_pictures(const PictureStack& stack, const ScanOptions& options);

}  // namespace marrow
