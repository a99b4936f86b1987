/// Reads scans: DICOM, NIfTI, NRRD, MetaImage, OME-Zarr, TIFF, and folders of image slices.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <marrow/export.h>
#include <marrow/label_table.h>
#include <marrow/progress.h>
#include <marrow/streaming.h>
#include <marrow/volume.h>

namespace marrow {

/// The formats that are read.
///
/// | format    | input                                    | geometry                                       |
/// | --------- | ---------------------------------------- | ---------------------------------------------- |
/// | dicom     | folder of DICOM files, or a file         | ImagePositionPatient, ImageOrientationPatient  |
/// | nifti     | .nii .nii.gz .hdr/.img                   | sform if its code is > 0, else qform; made LPS |
/// | nrrd      | .nrrd .nhdr                              | space directions and origin; made LPS          |
/// | metaimage | .mha .mhd                                | TransformMatrix, Offset, ElementSpacing        |
/// | zarr      | folder of OME-Zarr 0.4 or 0.5            | scale and translation of the axes x, y, z      |
/// | tiff      | .tif .tiff of one or more pages          | ScanOptions::spacing, required                 |
/// | slices    | folder of .png .tif .jpg .bmp, or a file | ScanOptions::spacing, required                 |
///
/// The content of a file decides its format; NIfTI and MetaImage also need their extension. Files in
/// a folder may have any name. A folder is DICOM if it or a nested folder holds a DICOM file. One DICOM file
/// stands for its series; the other files of that series are in the same folder. Image slices are in natural
/// order: slice 2 comes before slice 10. A Zarr array without the metadata of OME-Zarr must have
/// three axes, and states no spacing.
enum class ScanFormat { dicom, nifti, nrrd, metaimage, zarr, tiff, slices };

/// The name of a format: "DICOM", "NIfTI", "NRRD", "MetaImage", "Zarr", "TIFF" or "slices".
MARROW_EXPORT const char* scan_format_name(ScanFormat format);

/// How to read a scan. An option that does not apply to the input is an OptionError.
struct ScanOptions {
    /// The series to read, needed if the input holds several: its SeriesInfo::id or the first part of it, or
    /// its number in the list of inspect_scan, from 1.
    std::optional<std::string> series = {};
    /// mm along i, j and k. It is only for input that does not state its spacing: image slices, a single
    /// DICOM slice, DICOM without positions, Zarr without units.
    std::optional<Vec3d> spacing = {};
    bool resample = false;  ///< interpolate unevenly spaced DICOM slices linearly to even spacing
    /// Index of a volume, from 0, if the input holds several: a DICOM series with time points, echoes, ...,
    /// a 4-D NIfTI or MetaImage file, an OME-Zarr image with time points or channels. Any other has volume 0.
    std::optional<std::int64_t> volume = {};
    /// The level of an OME-Zarr image's resolution pyramid, from 0, the finest.
    std::optional<std::int64_t> level = {};
    /// Keep 8- and 16-bit samples whose values have a fraction as they are stored, with Volume::rescale(),
    /// instead of rescaling them to float32 in twice the memory or more. All functions of this library work
    /// on the values of such a volume. Whoever reads its samples must rescale them.
    bool keep_stored = false;
    int threads = 0;         ///< threads to use; 0: all
    Progress progress = {};  ///< called while reading
};

/// One series or image of an input.
struct SeriesInfo {
    std::string id;           ///< SeriesInstanceUID, with /1, /2, ... if it holds several volumes; else empty
    std::string description;  ///< SeriesDescription or file name; never the patient's name
    std::string modality;     ///< "CT", "MR", ...; empty if the format does not state it
    std::array<std::int64_t, 3> dims{0, 0, 0};
    Vec3d spacing{0, 0, 0};  ///< mm; 0 along an axis whose spacing is unknown
    std::size_t files = 0;   ///< number of files that it is made of
    LabelTable labels = {};  ///< names and colours of the segments, if it is a segmentation
    /// The DICOM files that were read, in the order of their slices. inspect_scan() leaves it empty.
    std::vector<std::filesystem::path> dicom_files = {};
};

/// What was read, apart from the samples.
struct ScanInfo {
    ScanFormat format{};
    SeriesInfo series;
    std::vector<std::string> warnings;  ///< one line each
    std::int64_t volumes = 1;           ///< number of volumes that ScanOptions::volume could choose
    /// PixelPaddingValue of DICOM, rescaled: the value outside the field of view. Not set if slices differ.
    std::optional<double> padding = {};
};

/// Reads a scan into memory. `info`, if given, receives a description.
///
/// DICOM:
/// - Slices are sorted by position. A series is split into parts with ids of their own where its slices
///   differ in size, orientation or spacing, and where a large gap separates them. If their positions do not
///   form one even stack, it is also split where they differ in frame of reference or modality.
/// - If a part has several slices at a position, and attributes tell them apart (ImageType, EchoTime,
///   b-value, TemporalPositionIdentifier, TriggerTime, AcquisitionNumber, ...), it holds several volumes, and
///   ScanOptions::volume chooses one.
/// - Scouts and single images are skipped if the input also holds a volume.
/// - Of several slices at one position with the same pixels, one is used. If the pixels differ, that is an
///   error.
/// - Slices whose spacing differs by more than 1 % or 0.01 mm are an error, unless ScanOptions::resample is
///   set.
/// - A segmentation is a label map, of uint8 or uint16. Segments that overlap are in different maps, of which
///   ScanOptions::volume chooses one. A sample of a fractional segmentation belongs to the segment if its
///   fraction is at least half of the largest one that can be stored.
/// - A tilted gantry gives a sheared geometry and a warning.
///
/// Sample types:
/// - Samples keep their type. uint32, int64 and uint64 become float64; values beyond 2^53 are an error.
/// - DICOM is rescaled to int16, or to float32 if a value is fractional or does not fit.
/// - Scaled NIfTI becomes float32, or float64 if it was stored as int32 or wider.
/// - With ScanOptions::keep_stored, samples whose slope or intercept has a fraction stay as they are stored:
///   NIfTI of 8 or 16 bits; DICOM of up to 16 bits, as int16 or uint16, if all slices have the same rescale
///   and are not resampled. A slope below 0 makes float32 all the same.
/// - Inverted grey (MONOCHROME1, white-is-zero TIFF) keeps its values.
///
/// Not supported: colour, vectors, complex numbers, NRRD with more than four dimensions or with samples as
/// text or bzip2, video, modality lookup tables, and data files outside their header's folder.
///
/// \throw IoError a file is missing or unreadable; InputError a file is damaged or not supported;
/// OptionError an option does not apply to the input; GeometryError several series without
/// ScanOptions::series, several volumes without ScanOptions::volume, uneven slices, or no spacing;
/// LimitError too large; Cancelled
MARROW_EXPORT Volume read_scan(const std::filesystem::path& input, const ScanOptions& options = {},
                               ScanInfo* info = nullptr);

/// Whether the headers say that read_scan would read a segmentation with these options, which gives label
/// maps: of DICOM or of 3D Slicer (.seg.nrrd). options.volume is not looked at.
/// \throw the errors of read_scan that the headers show
MARROW_EXPORT bool is_segmentation(const std::filesystem::path& input, const ScanOptions& options = {});

/// An image in a DICOM file.
struct DicomImage {
    std::filesystem::path file;
    std::size_t frame = 0;  ///< from 0
};

/// What the headers tell about one series.
struct SeriesReport {
    SeriesInfo series;
    std::optional<std::int64_t> number;      ///< SeriesNumber of DICOM
    std::string date;                        ///< SeriesDate of DICOM: "2005-07-26"; empty if it is not stated
    std::optional<double> echo_time;         ///< ms
    std::string image_type;                  ///< ImageType of DICOM, such as "ORIGINAL\\PRIMARY\\AXIAL"
    std::string kernel;                      ///< ConvolutionKernel of DICOM
    std::optional<Geometry> geometry;        ///< set if the headers give a complete one
    std::optional<std::string> refusal;      ///< why read_scan would fail, if the headers show it
    std::vector<std::string> warnings;       ///< the warnings of read_scan
    std::vector<std::string> gaps;           ///< unusual gaps: "4 mm between 'a' and 'b'"
    double tilt = 0;                         ///< of the gantry, degrees
    bool oriented = true;                    ///< whether it is stated how the axes lie in the patient
    std::optional<bool> hounsfield;          ///< whether samples are Hounsfield units, if known
    std::optional<double> smallest_feature;  ///< mm; twice the coarsest spacing: the finest visible detail
    std::uint64_t memory = 0;                ///< bytes that the samples need; 0 if they cannot be read
    /// If the series has several volumes, what distinguishes each: "echo time 12 ms". The other members
    /// describe the volume that ScanOptions::volume names, or the first.
    std::vector<std::string> volumes;
    /// The size of each level that ScanOptions::level could choose; empty if the format has none.
    std::vector<std::array<std::int64_t, 3>> levels;
    std::int64_t volume_count = 1;  ///< number of volumes that ScanOptions::volume could choose
    /// The middle slice of each volume, for a preview by read_dicom_image. Empty for
    /// segmentations and formats other than DICOM.
    std::vector<DicomImage> middle_slices;
    std::string patient_name;  ///< as in DICOM: "family^given"; show it only on request
};

/// What an input holds.
struct ScanReport {
    ScanFormat format{};
    std::size_t files = 0;  ///< number of files inspected
    std::vector<SeriesReport> series;
    std::optional<std::size_t> chosen;  ///< index of the series that read_scan would read
    std::string reason;                 ///< why read_scan would read that series, or none
    std::vector<std::string> warnings;  ///< about files that are skipped
};

/// Reports what read_scan would do with these options, from the headers alone.
/// \throw the errors of read_scan, if there is no image at all or an option does not apply to the input
MARROW_EXPORT ScanReport inspect_scan(const std::filesystem::path& input, const ScanOptions& options = {});

/// Reads one image of a DICOM file, to show what a series holds before it is read: the stored values, without
/// rescaling, as int32. The volume has one slice; only its spacing along i and j is known, if the file states
/// it.
/// \throw IoError; InputError; LimitError; Cancelled
MARROW_EXPORT Volume read_dicom_image(const DicomImage& image, const Progress& progress = {});

/// A volume of which any box can be read.
struct BoxSource {
    Geometry geometry;
    SampleType type = SampleType::uint8;
    std::array<std::int64_t, 3> chunk{1, 1, 1};  ///< the samples that are stored together, along x, y and z
    /// Returns a sample that may stand for all samples of the chunk with this index, which is then not read,
    /// or null. Any thread calls it.
    using KnownChunks = std::function<const void*(const std::array<std::int64_t, 3>& chunk)>;
    /// Writes the samples of the box that begins at `first` and has `dims` samples to `samples`,
    /// in the order of a VolumeView, on the threads of the current oneTBB arena. `known` may be
    /// empty. Any thread may call it.
    /// \throw InputError the box leaves the volume, or a chunk is damaged; IoError
    std::function<void(const std::array<std::int64_t, 3>& first, const std::array<std::int64_t, 3>& dims,
                       void* samples, const KnownChunks& known)>
        read;
};

/// Opens a scan to read boxes of it, for processes that work on parts of it: Zarr. Samples and geometry are
/// the same as from read_scan. \throw the errors of read_scan; InputError the input is not Zarr
MARROW_EXPORT BoxSource open_boxes(const std::filesystem::path& input, const ScanOptions& options = {});

/// Opens a scan to read it slice by slice, for volumes that do not fit in memory: Zarr, and uncompressed
/// NIfTI, NRRD and MetaImage. Samples, geometry and rescale are the same as from read_scan.
/// \throw the errors of read_scan; InputError the input must be read as a whole
MARROW_EXPORT SliceSource open_slices(const std::filesystem::path& input, const ScanOptions& options = {},
                                      ScanInfo* info = nullptr);

}  // namespace marrow
