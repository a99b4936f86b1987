// Joins the bounds of ranges of points.
#include "bounds.h"

#include "base/parallel.h"

namespace marrow::internal {

namespace {

// Calls include(bounds, i) for the numbers below `count`.
template <class Include>
Bounds joined(std::size_t count, const Include& include) {
    return parallel_reduce(
        std::size_t{0}, count, 4096, Bounds{},
        [&](const auto& range, Bounds sum) {
            for (std::size_t i = range.begin(); i < range.end(); ++i) include(sum, i);
            return sum;
        },
        [](Bounds a, const Bounds& b) {
            a.include(b);
            return a;
        });
}

}  // namespace

Bounds bounds_of(std::span<const Vec3f> points) {
    return joined(points.size(), [&](Bounds& bounds, std::size_t p) { bounds.include(points[p]); });
}

Bounds bounds_of_triangles(const MeshView& mesh) {
    return joined(mesh.triangles.size(), [&](Bounds& bounds, std::size_t t) {
        for (const std::uint32_t p : mesh.triangles[t]) bounds.include(mesh.points[p]);
    });
}

}  // namespace marrow::internal
