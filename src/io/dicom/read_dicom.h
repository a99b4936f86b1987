/// Reads DICOM series as volumes.
#pragma once

#include <marrow/scan_io.h>

#include "series.h"

namespace marrow::internal::io {

/// \throw the errors of inspect_scan
ScanReport inspect_dicom(const DicomInput& input, const ScanOptions& options);

/// As marrow::is_segmentation.
bool is_dicom_segmentation(const DicomInput& input, const ScanOptions& options);

/// As marrow::read_dicom_image.
Volume read_image(const DicomImage& image, const Progress& progress);

/// \throw the errors of read_scan
Volume read_dicom(const DicomInput& input, const ScanOptions& options, ScanInfo& info);

}  // namespace marrow::internal::io
