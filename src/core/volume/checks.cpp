// Checks arguments and results.
#include "checks.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <marrow/error.h>

namespace marrow::internal {

void check_volume(const VolumeView& volume) {
    check_geometry(volume.geometry);
    if (volume.data == nullptr && volume.geometry.sample_count() > 0)
        throw InputError("volume: the pointer to its samples is null");
}

void check_isovalue(double isovalue) {
    if (!std::isfinite(isovalue)) throw InputError("the isovalue is not a finite number");
}

void check_point_count(std::uint64_t points) {
    if (points <= std::numeric_limits<std::uint32_t>::max()) return;
    throw LimitError("the surface has " + std::to_string(points) +
                     " points, more than the 2^32 - 1 that triangles can name; crop or coarsen the volume");
}

bool has_cells(const Geometry& geometry, bool closed) {
    const std::int64_t fewest = *std::min_element(geometry.dims.begin(), geometry.dims.end());
    return fewest >= (closed ? 1 : 2);
}

}  // namespace marrow::internal
