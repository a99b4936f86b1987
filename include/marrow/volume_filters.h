/// Filters that prepare a volume for extraction: crop, median, blur, resample.
#pragma once

#include <array>
#include <cstdint>

#include <marrow/export.h>
#include <marrow/progress.h>
#include <marrow/volume.h>

namespace marrow {

/// A box whose sides are parallel to the axes of physical space (LPS, mm).
struct Box {
    Vec3d lower, upper;
};

struct FilterOptions {
    int threads = 0;         ///< threads to use; 0: all
    Progress progress = {};  ///< called while filtering
};

// All filters throw InputError on a null view and on bad geometry. crop and median_filter keep the volume's
// rescale; the samples that the others make are values.

/// Copies the samples from index `first` to index `last`, both included. They keep their positions in space.
/// \throw InputError a range that is empty or leaves the volume
MARROW_EXPORT Volume crop(const VolumeView& volume, const std::array<std::int64_t, 3>& first,
                          const std::array<std::int64_t, 3>& last);

/// Copies the smallest block of samples that holds all of the volume's samples in `box`. If the volume's axes
/// are parallel to those of physical space, these are exactly the samples in the box. An oblique volume keeps
/// more, because it can be cut only along its own axes. \throw InputError no sample lies in the box, or its
/// lower end is above its upper end
MARROW_EXPORT Volume crop(const VolumeView& volume, const Box& box);

/// Replaces each sample by the median of the samples up to `radius` away along each axis: a window of 2
/// radius + 1 samples a side, cut off at the volume's border. If their number is even, it is the higher of
/// the two middle ones. It removes single noisy samples and keeps edges. NaN is left out of the windows and
/// stays NaN. \throw InputError a radius that is not 1 to 16; Cancelled
MARROW_EXPORT Volume median_filter(const VolumeView& volume, int radius, const FilterOptions& options = {});

/// Blurs with a Gaussian of standard deviation `sigma` mm, cut off at four standard deviations, rounded up to
/// whole samples. At the border the weights inside the volume are scaled to the sum 1. The result is float32,
/// or float64 for int32 and float64, because rounding to integers would bring back steps. Infinite and NaN
/// samples have no weight and become NaN. \throw InputError a sigma that is not positive and finite;
/// LimitError not enough memory; Cancelled
MARROW_EXPORT Volume gaussian_filter(const VolumeView& volume, double sigma,
                                     const FilterOptions& options = {});

/// Resamples to `spacing` mm along all three axes by cubic convolution (Keys 1981). The first sample stays;
/// the last is the last one within the volume. New samples at positions of old ones keep their values, and an
/// axis that already has the spacing does not change. Spacings are equal to a millionth, because files hold
/// them as float32. An axis with a single sample keeps its spacing. It does not blur: before a coarser
/// spacing, call gaussian_filter. The result has the sample type that gaussian_filter gives. NaN spreads to
/// the samples that are interpolated from it. \throw InputError a spacing that is not positive and finite;
/// LimitError more than 2^30 samples along an axis, or not enough memory; Cancelled
MARROW_EXPORT Volume resample_isotropic(const VolumeView& volume, double spacing,
                                        const FilterOptions& options = {});

}  // namespace marrow
