/// Reads volumes made of images: TIFF files with several pages, and folders of slices.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <marrow/scan_io.h>

#include "image_file.h"

namespace marrow::internal::io {

/// Whether `a` comes before `b` in natural order: "2" before "10".
bool natural_less(const std::filesystem::path& a, const std::filesystem::path& b);

/// A volume made of images: one file with one or more pages, or one file for each slice.
struct ImageStack {
    std::vector<std::filesystem::path> files;
    ImageHeader image;  ///< the header of each file
    Geometry geometry;
    std::vector<std::string> warnings = {};  ///< one line each
};

/// Reads the headers of the files. Without options.spacing the spacing is 1.
/// \throw IoError; InputError, also if the headers differ; Cancelled
ImageStack read_image_stack(std::vector<std::filesystem::path> files, const ScanOptions& options);

/// Reads the samples. \throw IoError; InputError, also if a slice is in colour; Cancelled
Volume load_image_stack(const ImageStack& stack, const ScanOptions& options);

}  // namespace marrow::internal::io
