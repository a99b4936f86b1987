/// Reading scans.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <marrow/export.h>
#include <marrow/progress.h>
#include <marrow/streaming.h>
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
///   images are passed over where there is a volume. Two slices at one place with the same pixels count once, with
///   others they are refused; so are uneven slices (by more than 1 % or 0.01 mm), unless options.resample makes them
///   even. A tilted gantry gives a sheared geometry and a warning. Enhanced multi-frame files are read.
/// - Samples keep their type; uint32, int64 and uint64 become float64, or are refused where that would not be exact.
///   DICOM becomes int16 after rescaling, or float32 where the values are not integers or do not fit. Scaled NIfTI
///   becomes float32 (float64 from int32 and wider). MONOCHROME1 and white-is-zero pictures keep their values.
/// - Refused: colour, vectors, complex numbers, NRRD of more than three dimensions, NRRD as text or bzip2, video,
///   modality lookup tables, data files outside their header's folder, headers that claim more than their file holds.
struct ScanOptions {
    std::string series;  ///< SeriesInfo::id of the one to read; empty: the only one
    /// mm; for input that does not say: pictures, DICOM with a single slice or without positions. InputError
    /// where the input has its own.
    std::optional<Vec3d> spacing;
    /// Uneven DICOM slices become even ones, as far apart as most are: linear between neighbours.
    bool resample = false;
    std::optional<std::int64_t> volume;  ///< which one of a 4D NIfTI or MetaImage file, counted from 0
    int threads = 0;                     ///< for decoding; 0: all
    Progress progress = {};              ///< called while reading
};

/// One series or image found in an input.
struct SeriesInfo {
    std::string id;  ///< SeriesInstanceUID, with /1, /2 where it holds several volumes; empty outside DICOM
    std::string description;  ///< SeriesDescription or file name; never a patient's name
    std::string modality;     ///< "CT", "MR", ... or empty where the format does not say
    std::array<std::int64_t, 3> dims{0, 0, 0};
    Vec3d spacing{0, 0, 0};  ///< mm; 0 where it is unknown
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
MARROW_EXPORT Volume read_scan(const std::filesystem::path& input, const ScanOptions& options = {},
                               ScanInfo* info = nullptr);

/// What there is to say about one series before its samples are read.
struct SeriesReport {
    SeriesInfo series;
    std::string refusal;                ///< why read_scan refuses it; empty: its headers give no reason
    std::vector<std::string> warnings;  ///< what read_scan would warn about
    std::vector<std::string> gaps;      ///< "4 mm between 'a' and 'b'", where that is not as elsewhere
    double tilt = 0;                    ///< of the gantry, degrees
    /// Hounsfield units: yes, no, or nothing where the format does not say.
    std::optional<bool> hounsfield;
    /// The smallest detail that can show, mm: two samples along the coarsest axis; 0 where it is unknown.
    double smallest_feature = 0;
    std::uint64_t memory = 0;  ///< bytes that the samples take, read as they are
    std::string patient_name;  ///< as DICOM has it: "family^given"; not to be shown unless asked for
};

/// What an input holds.
struct ScanReport {
    std::string format;
    std::size_t files = 0;  ///< that were looked at
    std::vector<SeriesReport> series;
    std::optional<std::size_t> chosen;  ///< the series that read_scan would read
    std::string reason;                 ///< why that one, or why none, in a few words
    std::vector<std::string> warnings;  ///< about files that are left out
};

/// Looks at an input as read_scan would with these options, without reading samples.
/// \throw as read_scan, where there is no image at all.
MARROW_EXPORT ScanReport inspect_scan(const std::filesystem::path& input, const ScanOptions& options = {});

/// Opens a scan that is read slice by slice, for volumes that do not fit in memory: NIfTI, NRRD and MetaImage that are not
/// compressed. Samples and geometry are those of read_scan. \throw as read_scan; InputError input that can only be read whole
MARROW_EXPORT SliceSource open_slices(const std::filesystem::path& input, const ScanOptions& options = {},
                                      ScanInfo* info = nullptr);

/// Lists what an input holds, without reading samples. \throw as inspect_scan.
MARROW_EXPORT std::vector<SeriesInfo> list_series(const std::filesystem::path& input,
                                                  std::string* format = nullptr);

}  // namespace marrow
