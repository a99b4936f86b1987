// Computes the Morton keys of triangles and sorts by them.
#include "morton_curve.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <numeric>

#include "bounds.h"

namespace marrow::internal {

namespace {

// A stable radix sort by the 30 lower bits of the keys.
void sort_by_key(std::vector<MortonKey>& keys) {
    constexpr std::uint32_t kDigit = 1 << 10;
    std::vector<MortonKey> sorted(keys.size());
    for (int shift = 0; shift < 30; shift += 10) {
        std::array<std::size_t, kDigit + 1> start{};
        for (const MortonKey& k : keys) ++start[(k.key >> shift) % kDigit + 1];
        std::partial_sum(start.begin(), start.end(), start.begin());
        for (const MortonKey& k : keys) sorted[start[(k.key >> shift) % kDigit]++] = k;
        keys.swap(sorted);
    }
}

}  // namespace

std::vector<MortonKey> along_morton_curve(const MeshView& mesh) {
    Bounds bounds;
    for (const Vec3f& p : mesh.points) bounds.include(p);
    float longest = 0;
    for (std::size_t axis = 0; axis < 3; ++axis)
        longest = std::max(longest, bounds.upper[axis] - bounds.lower[axis]);
    const float scale = longest > 0 ? 1023 / (3 * longest) : 0;
    std::vector<MortonKey> keys(mesh.triangles.size());
    tbb::parallel_for(std::size_t{0}, keys.size(), [&](std::size_t i) {
        const Triangle& t = mesh.triangles[i];
        std::uint32_t key = 0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const float sum = mesh.points[t[0]][axis] + mesh.points[t[1]][axis] + mesh.points[t[2]][axis];
            const float cell = (sum - 3 * bounds.lower[axis]) * scale;
            key |= spread_bits(cell > 0 ? static_cast<std::uint32_t>(std::min(cell, 1023.0f)) : 0) << axis;
        }
        keys[i] = {key, static_cast<std::uint32_t>(i)};
    });
    sort_by_key(keys);
    return keys;
}

}  // namespace marrow::internal
