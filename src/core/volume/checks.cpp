// Checks arguments and results.
#include "checks.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <marrow/error.h>

namespace marrow::internal {

namespace {

// The samples that may be read must not overlap, and their indices in the whole must be in range.
void check_extent(const VolumeView& volume) {
    Geometry whole = volume.geometry;  // as much of it as the view says
    std::array<std::int64_t, 3> extent;
    for (std::size_t a = 0; a < 3; ++a) {
        constexpr std::int64_t kMost = std::int64_t{1} << 30;
        const std::int64_t first = volume.first[a], below = volume.below[a], above = volume.above[a];
        if (first < 0 || below < 0 || above < 0 || below > first || first > kMost || above > kMost)
            throw InputError("volume: first, below or above is out of range along axis " + std::to_string(a));
        extent[a] = volume.geometry.dims[a] + below + above;
        whole.dims[a] = first + volume.geometry.dims[a];
    }
    check_geometry(whole);
    constexpr std::int64_t kMostPitch = std::int64_t{1} << 56;
    // Before slice_pitch() multiplies the pitch of rows.
    const auto check_pitch = [&](std::int64_t pitch, std::int64_t count) {
        if (pitch > kMostPitch / std::max<std::int64_t>(count, 1))
            throw InputError("volume: a pitch is out of range");
    };
    const std::int64_t row = volume.row_pitch();
    check_pitch(row, extent[1]);
    const std::int64_t slice = volume.slice_pitch();
    check_pitch(slice, extent[2]);
    const bool rows_overlap = extent[1] > 1 && row < extent[0];
    const bool slices_overlap =
        extent[2] > 1 && slice < (extent[1] - 1) * std::max<std::int64_t>(row, 0) + extent[0];
    if (volume.pitch[0] < 0 || volume.pitch[1] < 0 || rows_overlap || slices_overlap)
        throw InputError(
            "volume: its rows or slices overlap; set each pitch to the samples from one to the next");
}

}  // namespace

void check_rescale(const Rescale& rescale) {
    if (!(rescale.slope >= std::numeric_limits<float>::min()) || !std::isfinite(rescale.slope) ||
        !std::isfinite(rescale.intercept))
        throw InputError("volume: the slope of its rescale is not positive, or a number of it is not finite");
}

void check_volume(const VolumeView& volume) {
    check_geometry(volume.geometry);
    check_rescale(volume.rescale);
    if (volume.geometry.sample_count() > 0) check_extent(volume);
    if (volume.data == nullptr && volume.geometry.sample_count() > 0)
        throw InputError("volume: the pointer to its samples is null");
}

void check_not_rescaled(const VolumeView& map) {
    if (!map.rescale.is_identity())
        throw InputError("the samples of a label map are its labels: this volume rescales its samples");
}

double checked_isovalue(double isovalue, const Rescale& rescale) {
    if (!std::isfinite(isovalue)) throw InputError("the isovalue is not a finite number");
    const double sample = rescale.sample(isovalue);
    if (!std::isfinite(sample)) throw InputError("the isovalue is too far from the values of the samples");
    return sample;
}

void check_point_count(std::uint64_t points) {
    if (points <= std::numeric_limits<std::uint32_t>::max()) return;
    throw LimitError("the surface has " + std::to_string(points) +
                     " points, more than the 2^32 - 1 that triangles can name; crop or coarsen the volume");
}

void throw_out_of_memory(const Geometry& geometry) {
    const auto& dims = geometry.dims;
    throw LimitError("there is not enough memory to extract a surface from " + std::to_string(dims[0]) +
                     " x " + std::to_string(dims[1]) + " x " + std::to_string(dims[2]) +
                     " samples; crop or coarsen the volume");
}

bool has_cells(const Geometry& geometry, bool closed) {
    const std::int64_t fewest = *std::min_element(geometry.dims.begin(), geometry.dims.end());
    return fewest >= (closed ? 1 : 2);
}

}  // namespace marrow::internal
