// Which DICOM frames make a volume together, and where it lies. Nothing here guesses: what does not fit is
// refused.
#pragma once

#include <string>
#include <vector>

#include <marrow/scan_io.h>

#include "read_dicom_file.h"

namespace marrow {

struct DicomSlice {
    const DicomFile* file;
    std::size_t index;  ///< of the frame in the file
    double along = 0;   ///< mm along the normal

    const DicomFrame& frame() const { return file->frames[index]; }
    /// The file, and the frame where there are several, for a message.
    std::string name() const;
};

/// Frames of one series, size, orientation, spacing, echo and frame of reference, in order along their
/// normal.
struct DicomStack {
    std::string id;  ///< SeriesInstanceUID, or SeriesInstanceUID/1, /2, ... where a series falls apart
    std::vector<DicomSlice> slices;

    const DicomFile& first() const { return *slices[0].file; }
};

/// Sorts the frames of `files`, which must outlive the result, into stacks: the largest first.
std::vector<DicomStack> stacks_of(const std::vector<DicomFile>& files);

/// Where the volume lies: the origin is the first slice's, the third axis goes from slice to slice, slanted
/// for a tilted gantry (with a warning). \throw GeometryError where the slices are uneven (by more than 1 %
/// or 0.01 mm), at one place, shifted sideways, or without position, orientation or spacing.
Geometry geometry_of(const DicomStack& stack, std::vector<std::string>& warnings);

}  // namespace marrow
