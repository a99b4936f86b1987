// Which DICOM frames make a volume together, and where it lies. Nothing here guesses: what does not fit is
// refused.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <marrow/scan_io.h>

#include "file.h"

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

/// Groups of slices that lie at one place, as indices into the stack's slices; places of one slice are left
/// out.
std::vector<std::vector<std::size_t>> slices_at_one_place(const DicomStack& stack);

/// Where the volume of a stack lies.
struct StackPlace {
    Geometry geometry;
    /// Where uneven slices lie, as fractional indices along the third axis of `geometry`, which is even; empty
    /// where the slices are even themselves.
    std::vector<double> uneven;
    double tilt = 0;  ///< of the gantry, degrees
    std::vector<std::string> warnings;
};

/// The origin is the first slice's, the third axis goes from slice to slice, slanted for a tilted gantry (with
/// a warning). `options.spacing` fills in what the headers leave out; `options.resample` makes uneven slices
/// even. \throw GeometryError where the slices are uneven (by more than 1 % or 0.01 mm), at one place, shifted
/// sideways, single, or without position, orientation or spacing, and the options do not help; where the
/// options contradict the headers.
StackPlace place_of(const DicomStack& stack, const ScanOptions& options);

/// "4 mm between 'a' and 'b'" for gaps that differ from the usual one.
std::vector<std::string> uneven_gaps(const DicomStack& stack);

}  // namespace marrow
