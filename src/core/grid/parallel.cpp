#include "parallel.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <marrow/error.h>

namespace marrow::internal {

void check_isovalue(double isovalue) {
    if (!std::isfinite(isovalue)) throw InputError("isovalue is not a finite number");
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

std::size_t share_count() {
    return kSharesPerThread * static_cast<std::size_t>(tbb::this_task_arena::max_concurrency());
}

std::size_t row_at(const HistoPyramid& pyramid, std::uint64_t key) {
    if (key >= pyramid.total()) return pyramid.leaves().size();
    const auto [row, remainder] = pyramid.locate(key);
    return row + (remainder > 0 ? 1 : 0);
}

}  // namespace marrow::internal
