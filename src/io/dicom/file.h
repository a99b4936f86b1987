// One DICOM file: what its header says about its frames, and its pixels.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <marrow/buffer.h>
#include <marrow/volume.h>

#include "io/scan/parallel_slices.h"

namespace marrow {

/// What differs between the frames of a file. Nothing where the file does not say.
struct DicomFrame {
    std::optional<Vec3d> position;      ///< ImagePositionPatient: centre of the first sample, LPS mm
    std::optional<Vec3d> along_row;     ///< ImageOrientationPatient: unit vector of increasing column index
    std::optional<Vec3d> along_column;  ///< the same of increasing row index
    std::optional<std::array<double, 2>> spacing;  ///< mm between columns, then between rows: x, y
    std::optional<double> thickness;               ///< mm
    std::optional<double> slope, intercept;        ///< NaN where they are there but are no numbers
};

struct DicomFile {
    std::filesystem::path path;
    std::string series_uid, frame_of_reference, description, modality, echo;
    std::string transfer_syntax;  ///< UID
    std::string refusal;          ///< why its pixels cannot be read; empty: they can
    std::string patient_name;     ///< never shown unless asked for
    bool localizer = false;       ///< a scout image, by ImageType
    std::optional<int> instance;  ///< InstanceNumber: the order of last resort
    std::int64_t columns = 0, rows = 0;
    int bits_allocated = 0, bits_stored = 0, high_bit = 0;
    bool is_signed = false;
    std::vector<DicomFrame> frames;
};

/// Reads a header. Nothing where the file is DICOM without an image: a report, a structure set, a directory.
/// \throw IoError; InputError where it is damaged.
std::optional<DicomFile> read_dicom_header(const std::filesystem::path& path);

/// Memory for decoding, used again from file to file: fresh pages cost as much as the decoding itself.
struct DicomWorkspace {
    Buffer<char> bytes;
    Buffer<std::int32_t> stored;
};

/// The stored values of all frames, not yet rescaled: columns fastest, then rows, then frames. They lie in
/// `workspace` until its next use. Calls `step` after each frame, or once. \throw IoError; InputError where they are
/// damaged, truncated or of a kind that is not read; Cancelled.
const std::int32_t* decode_dicom(const DicomFile& file, DicomWorkspace& workspace, const Step& step);

}  // namespace marrow
