/// Reading scans.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <marrow/progress.h>
#include <marrow/slabs.h>
#include <marrow/volume.h>

namespace marrow {

/// What is read:
///
/// | input                                 | format name | geometry from                                        |
/// | ------------------------------------- | ----------- | ---------------------------------------------------- |
/// | folder of DICOM files, one DICOM file | "DICOM"     | ImagePositionPatient and ImageOrientationPatient     |
/// | .nii .nii.gz .hdr/.img                | "NIfTI"     | sform if its code is > 0, else qform; RAS, made LPS  |
/// | .nrrd .nhdr                           | "NRRD"      | space directions and origin, made LPS                |
/// | .mha .mhd                             | "MetaImage" | TransformMatrix, Offset, ElementSpacing              |
/// | .tif .tiff (several pages)            | "TIFF"      | options.spacing, which is required                   |
/// | folder of .png .tif .jpg .bmp slices, or one such | "slices" | options.spacing, which is required; natural order |
///
/// - The content decides what a file is, its ending only where the content does not tell. DICOM files may have any
///   name and lie in nested folders; where there are none, pictures count. One DICOM file stands for the series it
///   belongs to, whose other files are beside it.
/// - DICOM: slices are sorted by their position, never by name or number. Frames of one series that differ in size,
///   orientation, spacing, echo or frame of reference, or lie far apart, are series of their own. Scouts and single
///   images are passed over where there is a volume. Uneven slices (by more than 1 % or 0.01 mm) and two slices at one
///   place are refused; a tilted gantry gives a sheared geometry and a warning. Enhanced multi-frame files are read.
/// - Samples keep their type; uint32, int64 and uint64 become float64, or are refused where that would not be exact.
///   DICOM becomes int16 after rescaling, or float32 where the values are not integers or do not fit. Scaled NIfTI
///   becomes float32 (float64 from int32 and wider). MONOCHROME1 and white-is-zero pictures keep their values.
/// - Refused: colour, vectors, complex numbers, more than three dimensions, NRRD as text or bzip2, tiled TIFF, video,
///   data files outside their header's folder, headers that claim more than their file holds.
struct ScanOptions {
    std::string series;            ///< SeriesInfo::id of the one to read; empty: the only one
    std::optional<Vec3d> spacing;  ///< mm; for input that has none, InputError where it has its own
    int threads = 0;         ///< for decoding; 0: all
    Progress progress = {};  ///< called while reading
};

/// One series or image found in an input.
struct SeriesInfo {
    std::string id;           ///< SeriesInstanceUID, with /1, /2 where it holds several volumes; empty outside DICOM
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

/// Reads a scan into memory. `info`, where given, receives what was read.
/// \throw IoError a missing or unreadable file; InputError a damaged or unsupported one; GeometryError several
/// series without `options.series`, uneven slices, no spacing; LimitError too big; Cancelled.
Volume read_scan(const std::filesystem::path& input, const ScanOptions& options = {},
                 ScanInfo* info = nullptr);

/// Opens a scan that is read slice by slice, for volumes that do not fit in memory: NIfTI, NRRD and MetaImage that are not
/// compressed. Samples and geometry are those of read_scan. \throw as read_scan; InputError input that can only be read whole
SliceSource open_slices(const std::filesystem::path& input, const ScanOptions& options = {}, ScanInfo* info = nullptr);

/// Lists what an input holds, without reading samples; an unknown spacing is 0.
/// \throw as read_scan.
std::vector<SeriesInfo> list_series(const std::filesystem::path& input, std::string* format = nullptr);

}  // namespace marrow
