/// Makes a small picture of a scan.
#pragma once

#include <filesystem>

#include <marrow/volume.h>

namespace marrow::apps {

/// Writes the middle slice across the third index axis as a grey PNG file, with square pixels, 256 along the
/// longer side. It lies as radiologists show it: the patient's left or posterior to the right; down is posterior
/// in axial slices, else inferior. Grey runs from the 1st to the 99th percentile of the slice; samples that are not
/// finite are black. \throw IoError the file cannot be written
void write_thumbnail(const Volume& scan, const std::filesystem::path& file);

}  // namespace marrow::apps
