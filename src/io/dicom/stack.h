/// Groups DICOM frames into volumes and computes their geometry. Nothing is guessed: inconsistent frames are
/// an error.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <marrow/scan_io.h>

#include "file.h"

namespace marrow::internal::io {

struct DicomSlice {
    const DicomFile* file;
    std::size_t index;  ///< of the frame in the file
    double along = 0;   ///< position along the normal, mm

    const DicomFrame& frame() const { return file->frames[index]; }
    /// The path in quotes, and the frame if there are several, for messages.
    std::string name(bool with_folder = true) const;
};

/// Frames of the same series, size, orientation and spacing, sorted along their normal: a volume, unless
/// geometry_of refuses it.
struct DicomStack {
    std::string id;  ///< of its series
    std::vector<DicomSlice> slices;
    std::string difference = {};  ///< from the other volumes of the series; empty if there are none
    std::optional<VolumeAttribute> order = {};  ///< if only the order of its values tells them apart

    const DicomFile& first() const { return *slices[0].file; }
};

/// The volumes of a series, or of a part of it.
struct DicomSeries {
    std::string id;  ///< SeriesInstanceUID, with /1, /2, ... if the series has several parts
    std::vector<DicomStack> volumes;

    const DicomFile& first() const { return volumes[0].first(); }
    std::size_t slices() const;
};

/// Groups the frames of `files` into series, the largest first. The files must outlive the result.
///
/// Frames are separated only if they cannot be one volume:
///
/// | attribute                          | separates                                                        |
/// | ---------------------------------- | ---------------------------------------------------------------- |
/// | SeriesInstanceUID                  | always: it says which images belong together                     |
/// | Rows, Columns                      | always: a volume has one grid                                    |
/// | ImageOrientationPatient            | always, beyond 0.001: slices are parallel                        |
/// | PixelSpacing                       | always, beyond 0.0001 mm: a volume has one grid                  |
/// | ImagePositionPatient present       | always: a slice without a position has no place among the others |
/// | ImageType LOCALIZER                | always: a scout is never part of a volume                        |
/// | a gap of ten slices or more        | if there are three slices or more on either side                 |
/// | FrameOfReferenceUID, Modality      | if the positions form no even stack; anonymisers replace them    |
/// | the attributes of volumes          | if slices have the same position; see divide_into_volumes        |
/// | anything else                      | never                                                            |
///
/// \throw InputError a series has too many different geometries
std::vector<DicomSeries> group_into_series(const std::vector<DicomFile>& files);

inline constexpr char kBadOrientation[] = "its ImageOrientationPatient is not two perpendicular unit vectors";

/// The directions of a frame's rows, columns and normal, as unit vectors. No value if ImageOrientationPatient
/// is not two perpendicular unit vectors. \pre the frame states it
std::optional<Mat3d> axes_of(const DicomFrame& frame);

/// Groups of slices that have the same position, as indices into the stack's slices.
std::vector<std::vector<std::size_t>> coincident_slices(const DicomStack& stack);

struct StackGeometry {
    Geometry geometry;
    /// For uneven slices, their positions as fractional indices along the third axis of `geometry`, which is
    /// even. Empty if the slices are even.
    std::vector<double> uneven;
    double tilt = 0;  ///< of the gantry, degrees
    std::vector<std::string> warnings;
};

/// Computes the geometry of a stack. The origin is the position of the first slice. The third axis is the
/// step between slices; it is oblique for a tilted gantry, with a warning. options.spacing supplies what the
/// headers lack. options.resample allows uneven slices.
/// \throw GeometryError the slices are uneven (by more than 1 % or 0.01 mm), coincide, are shifted sideways,
/// are single, or lack position, orientation or spacing, and the options do not help; or the options
/// contradict the headers
StackGeometry geometry_of(const DicomStack& stack, const ScanOptions& options);

/// An unusual distance between a slice and the next.
struct UnevenGap {
    std::size_t slice;  ///< index into the stack's slices
    double length;      ///< mm
};

std::vector<UnevenGap> uneven_gaps(const DicomStack& stack);

}  // namespace marrow::internal::io
