/// How a scan's surface depends on the isovalue.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <marrow/export.h>
#include <marrow/progress.h>
#include <marrow/volume.h>

namespace marrow {

/// The closed surface at one isovalue, in numbers.
struct SweepSample {
    double isovalue = 0;
    double volume = 0;  ///< mm^3 enclosed
    double area = 0;    ///< mm^2
    std::int64_t components = 0;
    std::int64_t triangles = 0;
};

struct SweepOptions {
    int threads = 0;         ///< threads to use; 0: all
    Progress progress = {};  ///< called while measuring
};

/// Measures the closed surfaces at all `isovalues`, without making them: the numbers are those of measure() on what
/// extract_isosurface(volume, isovalue, {.closed = true}) makes, area and volume to about 1e-5 of them. Every cell is visited
/// once, for all isovalues that it is crossed by. Components are counted on the samples: closed surfaces part space into one
/// region more than there are surfaces, inside samples hang together along edges of the grid and outside ones across diagonals
/// of its faces too. The same numbers for any number of threads.
/// \throw InputError isovalues that are not finite or not ascending, or bad geometry; Cancelled
MARROW_EXPORT std::vector<SweepSample> sweep_isovalues(const VolumeView& volume,
                                                       std::span<const double> isovalues,
                                                       const SweepOptions& options = {});

/// How far the surface moves on average from one sample of a sweep to the next, in mm: the change of volume over the mean of
/// both areas; 0 without surfaces.
MARROW_EXPORT double surface_shift(const SweepSample& a, const SweepSample& b);

/// Samples first to last of a sweep.
struct Plateau {
    std::size_t first, last;
};

/// The stretches of a sweep where the isovalue matters little: at least a fifth of the scan's contrast wide, and all along them
/// the surface moves by less than half a spacing for each fifth of the contrast. Both scales are the scan's, so that a stretch
/// is a plateau or not whatever else is swept; where the sweep begins or ends within one, what is left must be as wide. Where an
/// edge between air and tissue is as sharp as a scan can show it, the surface moves by one or two samples over the whole
/// contrast, so that its middle is a plateau. Only where triangles are fewer than a hundredth of the most in the sweep, the
/// surface is taken to be as good as gone, and there is none. `spacing` is the smallest between samples, mm, and `contrast` that of
/// otsu_contrast(); 0: no plateaus. \pre isovalues ascend
MARROW_EXPORT std::vector<Plateau> find_plateaus(std::span<const SweepSample> sweep, double spacing,
                                                 double contrast);

}  // namespace marrow
