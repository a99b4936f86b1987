/// What is done to a volume before a surface is extracted from it.
#pragma once

#include <array>
#include <cstdint>

#include <marrow/export.h>
#include <marrow/progress.h>
#include <marrow/volume.h>

namespace marrow {

/// A box with sides along the axes of a space.
struct Box {
    Vec3d lower, upper;
};

struct FilterOptions {
    int threads = 0;         ///< threads to use; 0: all
    Progress progress = {};  ///< called while filtering
};

/// The samples from `first` to `last`, both included, where they were in space. \throw InputError a range that
/// is empty or leaves the volume
MARROW_EXPORT Volume crop(const VolumeView& volume, const std::array<std::int64_t, 3>& first,
                          const std::array<std::int64_t, 3>& last);

/// The smallest block of samples that holds all of the volume's samples in `box`, in patient space (LPS mm).
/// Where the volume's axes run along those of the patient, these are the samples in the box; an oblique volume
/// keeps more, since it cannot be cut across its axes. \throw InputError where box and volume have nothing in
/// common, or the box's ends are in the wrong order
MARROW_EXPORT Volume crop(const VolumeView& volume, const Box& box);

/// Each sample becomes the median of those up to `radius` samples away along each axis, 2 radius + 1 a side,
/// as far as they lie in the volume; the higher of two middle ones. Takes off single noisy samples and keeps
/// edges. NaN is left out, and stays NaN itself. \throw InputError a radius outside 1 to 16; Cancelled
MARROW_EXPORT Volume median_filter(const VolumeView& volume, int radius, const FilterOptions& options = {});

/// Convolves with a Gaussian of standard deviation `sigma` mm, cut at four of them; at the volume's border with
/// the part of it that lies inside. The result is float32, float64 of int32 and float64: rounding to integers
/// would bring the steps back. Infinite and NaN samples are left out, and become NaN. \throw InputError a sigma
/// that is not positive and finite; Cancelled
MARROW_EXPORT Volume gaussian_filter(const VolumeView& volume, double sigma,
                                     const FilterOptions& options = {});

/// Resamples to `spacing` mm along all three axes, from the same first sample to the last that still lies
/// within the volume, by cubic convolution (Keys 1981): it keeps the samples that it meets, and an axis that
/// has the spacing already. Does not blur: to a coarser spacing, use gaussian_filter first. The result's type
/// is as gaussian_filter's; NaN spreads to what is interpolated from it. \throw InputError a spacing that is
/// not positive and finite, LimitError more than 2^30 samples along an axis or no memory; Cancelled
MARROW_EXPORT Volume resample_isotropic(const VolumeView& volume, double spacing,
                                        const FilterOptions& options = {});

}  // namespace marrow
