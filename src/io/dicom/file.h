/// Reads one DICOM file: the header of its frames, and its pixels.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <marrow/buffer.h>
#include <marrow/label_table.h>
#include <marrow/volume.h>

#include "io/scan/parallel_slices.h"
#include "volume_attributes.h"

namespace marrow::internal::io {

/// The attributes that may differ between the frames of a file. No value if the file does not state them.
struct DicomFrame {
    std::optional<Vec3d> position;      ///< ImagePositionPatient: centre of the first sample, mm in LPS
    std::optional<Vec3d> along_row;     ///< ImageOrientationPatient: direction of increasing column index
    std::optional<Vec3d> along_column;  ///< direction of increasing row index
    std::optional<std::array<double, 2>> spacing;  ///< mm between columns and between rows
    std::optional<double> thickness;               ///< mm
    std::optional<double> slope, intercept;        ///< NaN if present but not a number
    std::string rescale_type;       ///< the unit of rescaled values, such as "HU"; may be empty
    std::optional<double> between;  ///< SpacingBetweenSlices, mm
    int segment = 0;                ///< of a segmentation; 0 if it is not stated
    VolumeAttributes volume;
};

/// What a segmentation is about.
struct DicomSegmentation {
    enum class Type { binary, fractional, label_map };

    Type type = Type::binary;
    int largest_fraction = 1;  ///< the stored value of a sample that is all inside
    LabelTable segments;       ///< their names and colours
};

struct DicomFile {
    std::filesystem::path path;
    std::uint64_t size = 0;  ///< bytes
    std::string series_uid, frame_of_reference, description, modality;
    std::string transfer_syntax;         ///< UID
    std::optional<std::string> refusal;  ///< why its pixels cannot be read
    std::string patient_name;            ///< only shown on request
    std::string image_type;              ///< ImageType: "ORIGINAL\\PRIMARY\\AXIAL"
    std::string kernel;                  ///< ConvolutionKernel
    std::string date;                    ///< SeriesDate: "20050726"
    std::optional<std::int64_t> series_number;
    std::optional<double> echo_time;     ///< ms
    bool localizer = false;              ///< whether ImageType says that it is a scout image
    std::optional<int> instance;         ///< InstanceNumber: orders slices without a position
    std::int64_t columns = 0, rows = 0;  ///< of a frame
    std::int64_t tiles = 1;              ///< along each side of a mosaic, whose tiles are the frames
    int bits_allocated = 0, bits_stored = 0, high_bit = 0;
    bool is_signed = false;
    std::optional<int> padding;  ///< PixelPaddingValue, a stored value
    std::optional<DicomSegmentation> segmentation;
    std::vector<DicomFrame> frames;
};

/// Reads a header. No value if the file is DICOM without an image: a report, a structure set, a directory; or
/// if its pixels are floating-point.
/// \throw IoError; InputError it is damaged
std::optional<DicomFile> read_dicom_header(const std::filesystem::path& path);

/// Text of an element that is safe in messages: in UTF-8, without control characters. `file` states the
/// character set.
std::string readable_text(const DicomDataSet& data_set, DicomTag tag, const DicomDataSet& file);

/// Why a DICOM file without an image cannot be read: "is an RT structure set; a scan has images".
/// \throw IoError; InputError it is damaged
std::string reason_without_image(const std::filesystem::path& path);

/// Memory for decoding. Reuse it from file to file: new memory pages cost as much time as decoding.
struct DicomWorkspace {
    Buffer<char> bytes;
    Buffer<std::int32_t> stored;
};

/// Decodes all frames without rescaling: columns fastest, then rows, then frames. The result is in
/// `workspace` and valid until its next use. Calls `step` after each frame, or once.
/// \throw IoError; InputError the pixels are damaged, truncated or not supported; LimitError; Cancelled
const std::int32_t* decode_dicom(const DicomFile& file, DicomWorkspace& workspace, const Step& step);

}  // namespace marrow::internal::io
