/// How the samples of a volume are distributed, and the isovalue this suggests.
#pragma once

#include <cstdint>
#include <vector>

#include <marrow/export.h>
#include <marrow/volume.h>

namespace marrow {

/// Counts of samples in equal bins from the smallest to the largest finite sample.
struct Histogram {
    double lower = 0;                     ///< smallest finite sample
    double upper = 0;                     ///< largest finite sample; the last bin includes it
    std::vector<std::int64_t> counts;     ///< empty where no sample is finite
    std::int64_t non_finite_samples = 0;  ///< NaN and infinite samples, which are in no bin
};

/// Counts the samples of a volume in `bins` bins. \throw InputError bad geometry or bins < 2.
MARROW_EXPORT Histogram histogram(const VolumeView& volume, int bins = 256);

/// The isovalue that best parts the samples in two classes: the bin border with the largest variance between
/// them (Otsu 1979); the middle one where several are equally good, as between two separate peaks. \throw
/// InputError where fewer than two bins are occupied: there is nothing to part.
MARROW_EXPORT double otsu_isovalue(const Histogram& histogram);

/// How far the means of the two classes that Otsu's method parts the samples in lie from each other, to within a bin: in CT
/// about that of air and tissue. 0 where there is nothing to part.
MARROW_EXPORT double otsu_contrast(const Histogram& histogram);

}  // namespace marrow
