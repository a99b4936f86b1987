// Joins the bounds of ranges of points.
#include "bounds.h"

#include <algorithm>

#include "base/parallel.h"

namespace marrow::internal {

Bounds bounds_of(std::span<const Vec3f> points) {
    return parallel_reduce(
        std::size_t{0}, points.size(), 4096, Bounds{},
        [&](const auto& range, Bounds sum) {
            // The bounds of every fourth point, in a loop that compilers turn into vectors.
            constexpr std::size_t kFloats = 12;
            float lower[kFloats], upper[kFloats];
            std::fill_n(lower, kFloats, Bounds::kInfinity);
            std::fill_n(upper, kFloats, -Bounds::kInfinity);
            std::size_t p = range.begin();
            for (; p + 4 <= range.end(); p += 4) {
                const float* const xyz = points[p].data();
                for (std::size_t i = 0; i < kFloats; ++i) {
                    lower[i] = std::min(lower[i], xyz[i]);
                    upper[i] = std::max(upper[i], xyz[i]);
                }
            }
            for (std::size_t i = 0; i < kFloats; i += 3) {
                sum.include({lower[i], lower[i + 1], lower[i + 2]});
                sum.include({upper[i], upper[i + 1], upper[i + 2]});
            }
            for (; p < range.end(); ++p) sum.include(points[p]);
            return sum;
        },
        [](Bounds a, const Bounds& b) {
            a.include(b.lower);
            a.include(b.upper);
            return a;
        });
}

}  // namespace marrow::internal
