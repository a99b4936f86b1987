/// How far the points of an isosurface can be trusted: how much the choice of the isovalue and
/// the noise of the scan move them.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <marrow/buffer.h>
#include <marrow/export.h>
#include <marrow/progress.h>
#include <marrow/vector.h>
#include <marrow/volume.h>

namespace marrow {

/// The noise of a scan, in the unit of its values. The estimators disagree where noise is not white or where
/// tissue has texture, so their spread says how far `sigma` can be trusted.
struct NoiseEstimate {
    double sigma = 0;                ///< standard deviation: the lower of the next two
    double local_deviation = 0;      ///< the mode of the standard deviations in windows of 7 x 7 samples
    std::optional<double> slices;    ///< from differences of neighbouring slices; not set: there is one slice
    double laplacian = 0;            ///< from second differences within slices; sees only fine noise
    double lowest = 0, highest = 0;  ///< of these three
    std::int64_t windows = 0;        ///< windows that were used; 0: too few suit, and nothing is known
};

struct NoiseOptions {
    std::optional<double> padding = {};  ///< ScanInfo::padding: the value of samples that are left out
    int threads = 0;                     ///< 0: all
    Progress progress = {};
};

/// Estimates the noise in tissue: in windows of 7 x 7 samples within a slice whose samples are all above the
/// value that Otsu's method gives for the scan, and no padding. Air is left out, because CT cuts it off at
/// -1024 and MRI at 0, which makes its noise look smaller.
///
/// The mode of local standard deviations after Coupe et al. 2010 and the "global noise level" of CT
/// (Christianson et al. 2015); the Laplacian after Immerkaer 1996, with the median absolute
/// deviation. So many slices are read, spread evenly over the scan, that they have about 200,000 windows, and
/// at least one. \throw InputError a null view or bad geometry; Cancelled
MARROW_EXPORT NoiseEstimate estimate_noise(const VolumeView& volume, const NoiseOptions& options = {});

struct TrustOptions {
    /// The change of the isovalue whose effect is reported, such as 100 for Hounsfield units; > 0. Not set: a
    /// tenth of the contrast, which otsu_contrast() gives, or 1 without contrast
    std::optional<double> step = {};
    std::optional<NoiseEstimate> noise = {};  ///< of the scan; not set: it is estimated
    /// ScanInfo::padding: noise and contrast leave samples of this value out
    std::optional<double> padding = {};
    int threads = 0;  ///< 0: all
    Progress progress = {};
};

/// The distribution of a distance over the points of a surface, mm.
struct TrustPercentiles {
    double median = 0, percentile_90 = 0, percentile_99 = 0;
    std::int64_t capped = 0;  ///< points where it is larger than TrustReport::cap, and is given as that
};

/// The result of report_trust().
struct TrustReport {
    double step = 0;      ///< the change of the isovalue
    double cap = 0;       ///< mm; the largest distance between neighbouring samples
    NoiseEstimate noise;  ///< of the scan
    Buffer<float> shift;  ///< mm for each point: how far the surface moves if the isovalue changes by `step`
    Buffer<float> noise_shift;  ///< mm for each point: the standard deviation of its position due to noise
    TrustPercentiles shifts, noise_shifts;
    /// Points outside the samples, such as those that close the surface at the border. Their values are 0,
    /// and do not count in the percentiles.
    std::int64_t border_points = 0;
};

/// Reports how far each point of an isosurface of `volume` can be trusted.
///
/// With the gradient g of the samples at a point, the surface moves by step / |g|, and noise of standard
/// deviation s moves it by s w / |g|, where w is the root of the sum of squared weights of the samples that
/// it is interpolated from (Pöthkow and Hege 2011). g is the central difference, over one sample, of the
/// trilinear interpolant. Noise is taken as independent between samples; w is between 0.35 and 1, so
/// correlated noise moves a point by less than three times as much.
///
/// The points need not be those of an extraction: they may be smoothed or reduced, but the report is that of
/// the scan where they are. The result has the same bits for any number of threads. \throw InputError a null
/// view, bad geometry, or a step that is not positive and finite; Cancelled
MARROW_EXPORT TrustReport report_trust(const VolumeView& volume, std::span<const Vec3f> points,
                                       const TrustOptions& options = {});

/// The colour, sRGB, for a distance that is this fraction of the largest: light grey for 0, over yellow and
/// red to dark red for 1 and more. \pre not NaN
MARROW_EXPORT std::array<std::uint8_t, 3> trust_colour(double fraction);

/// A colour for each point: trust_colour() of its shift, with `report.cap` as the largest. Points of
/// `near_walls` (near_thin_walls), if given, are blue.
MARROW_EXPORT std::vector<std::array<std::uint8_t, 3>> trust_colours(
    const TrustReport& report, const std::vector<bool>& near_walls = {});

}  // namespace marrow
