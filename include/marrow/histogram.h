/// The distribution of a volume's samples, and the isovalue that it suggests.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <marrow/export.h>
#include <marrow/volume.h>

namespace marrow {

/// Counts of samples in equal bins from the smallest to the largest finite value that is not padding.
struct Histogram {
    double lower = 0;                     ///< the smallest of these values
    double upper = 0;                     ///< the largest of them, which is in the last bin
    std::vector<std::int64_t> counts;     ///< empty if no sample is finite
    std::int64_t non_finite_samples = 0;  ///< NaN and infinite samples, which are in no bin
};

/// Counts the samples of a volume in `bins` bins, on one thread. Samples with the value `padding`
/// (ScanInfo::padding) are left out, unless that leaves fewer than two values. \throw InputError a null view,
/// bad geometry, or bins < 2
MARROW_EXPORT Histogram histogram(const VolumeView& volume, int bins = 256,
                                  std::optional<double> padding = {});

/// The isovalue that best separates the samples into two classes: the border between bins with the largest
/// variance between the classes (Otsu 1979). If several borders are equally good, as between two separate
/// peaks, it is the middle one.
///
/// Padding is left out, which CT scanners write outside their field of view, often -2000 or -3024. Otherwise
/// the best border could be the one between padding and air. If histogram() was not told its value, it is a
/// lowest bin below -1024, the lowest Hounsfield unit of a 12-bit scan, that no sample follows closely.
/// \throw InputError fewer than two bins hold samples
MARROW_EXPORT double otsu_isovalue(const Histogram& histogram);

/// The distance between the means of the two classes that otsu_isovalue() separates, with the precision of a
/// bin and without padding. In CT this is about the contrast between air and tissue. 0 if fewer than two bins
/// hold samples.
MARROW_EXPORT double otsu_contrast(const Histogram& histogram);

}  // namespace marrow
