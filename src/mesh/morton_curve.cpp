#include "morton_curve.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

namespace marrow::internal {

namespace {

// The 10 lower bits, three apart.
std::uint32_t spread(std::uint32_t x) {
    x = (x | x << 16) & 0x030000ff;
    x = (x | x << 8) & 0x0300f00f;
    x = (x | x << 4) & 0x030c30c3;
    return (x | x << 2) & 0x09249249;
}

// Sorts by the 30 lower bits of the keys; equals keep their order.
void sort_by_key(std::vector<OnCurve>& keyed) {
    constexpr std::uint32_t kDigit = 1 << 10;
    std::vector<OnCurve> sorted(keyed.size());
    for (int shift = 0; shift < 30; shift += 10) {
        std::array<std::size_t, kDigit + 1> start{};
        for (const OnCurve& k : keyed) ++start[(k.key >> shift) % kDigit + 1];
        std::partial_sum(start.begin(), start.end(), start.begin());
        for (const OnCurve& k : keyed) sorted[start[(k.key >> shift) % kDigit]++] = k;
        keyed.swap(sorted);
    }
}

}  // namespace

std::vector<OnCurve> along_morton_curve(const Mesh& mesh) {
    constexpr float kFar = std::numeric_limits<float>::infinity();
    Vec3f lower{kFar, kFar, kFar}, upper{-kFar, -kFar, -kFar};
    for (const Vec3f& p : mesh.points) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            lower[axis] = std::min(lower[axis], p[axis]);
            upper[axis] = std::max(upper[axis], p[axis]);
        }
    }
    float longest = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) longest = std::max(longest, upper[axis] - lower[axis]);
    const float scale = longest > 0 ? 1023 / (3 * longest) : 0;
    std::vector<OnCurve> keyed(mesh.triangles.size());
    tbb::parallel_for(std::size_t{0}, keyed.size(), [&](std::size_t i) {
        const Triangle& t = mesh.triangles[i];
        std::uint32_t key = 0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const float sum = mesh.points[t[0]][axis] + mesh.points[t[1]][axis] + mesh.points[t[2]][axis];
            const float cell = (sum - 3 * lower[axis]) * scale;
            key |= spread(cell > 0 ? static_cast<std::uint32_t>(std::min(cell, 1023.0f)) : 0) << axis;
        }
        keyed[i] = {key, static_cast<std::uint32_t>(i)};
    });
    sort_by_key(keyed);
    return keyed;
}

}  // namespace marrow::internal
