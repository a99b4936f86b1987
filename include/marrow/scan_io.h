/// Reading scans.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <marrow/progress.h>
#include <marrow/volume.h>

namespace marrow {

/// What is read:
///
/// | input                                 | format name | geometry from | |
/// ------------------------------------- | ----------- | ------------------------------------------------- |
/// | folder of DICOM files, one DICOM file | "DICOM"     | ImagePositionPatient and ImageOrientationPatient |
/// | .nii .nii.gz .hdr/.img                | "NIfTI"     | sform, else qform; RAS turned to LPS | | .nrrd
/// .nhdr                           | "NRRD"      | space directions and origin, turned to LPS        | | .mha
/// .mhd                             | "MetaImage" | TransformMatrix, Offset, ElementSpacing           | |
/// .tif .tiff (several pages)            | "TIFF"      | options.spacing, which is required                |
/// | folder of .png .tif .jpg .bmp slices  | "slices"    | options.spacing, which is required; natural order
/// |
struct ScanOptions {
    std::string series;  ///< DICOM SeriesInstanceUID to read, as listed; empty: the only one
    std::optional<Vec3d>
        spacing;             ///< mm; for input that has none. \throw InputError where the input has its own
    int threads = 0;         ///< for decoding; 0: all
    Progress progress = {};  ///< called while reading
};

/// One series or image found in an input.
struct SeriesInfo {
    std::string id;           ///< what ScanOptions::series takes; empty outside DICOM
    std::string description;  ///< SeriesDescription or file name; never a patient's name
    std::string modality;     ///< "CT", "MR", ... or empty where the format does not say
    std::array<std::int64_t, 3> dims{0, 0, 0};
    Vec3d spacing{0, 0, 0};  ///< mm
    std::size_t files = 0;   ///< files it is made of
};

/// What was read, beside the samples.
struct ScanInfo {
    std::string format;  ///< as in the table above
    SeriesInfo series;
    std::vector<std::string> warnings;  ///< one line each
};

/// Reads a scan into memory, in its own sample type (rescaled DICOM: int16, or float32 where slope and
/// intercept ask for it). `info`, where given, receives what was read. \throw IoError a missing or unreadable
/// file; InputError a damaged or unsupported one; GeometryError several series without `options.series`,
/// uneven slices, no spacing; LimitError too big; Cancelled.
Volume read_scan(const std::filesystem::path& input, const ScanOptions& options = {},
                 ScanInfo* info = nullptr);

/// Lists what an input holds, without reading samples. \throw as read_scan.
std::vector<SeriesInfo> list_series(const std::filesystem::path& input, std::string* format = nullptr);

}  // namespace marrow
