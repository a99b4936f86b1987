// Joins the bounds of ranges of points.
#include "bounds.h"

#include "base/parallel.h"

namespace marrow::internal {

Bounds bounds_of(std::span<const Vec3f> points) {
    return parallel_reduce(
        std::size_t{0}, points.size(), 4096, Bounds{},
        [&](const auto& range, Bounds sum) {
            for (std::size_t p = range.begin(); p < range.end(); ++p) sum.include(points[p]);
            return sum;
        },
        [](Bounds a, const Bounds& b) {
            a.include(b);
            return a;
        });
}

}  // namespace marrow::internal
