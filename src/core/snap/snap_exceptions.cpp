// Finds samples by the positions of points.
#include "snap_exceptions.h"

#include <algorithm>
#include <cmath>

namespace marrow::internal {

SnapExceptions::Sample SnapExceptions::sample_nearest_to(const Vec3f& point) const {
    const Vec3d index = to_index_ * (to_double(point) - input_.to_physical.origin);
    const auto& first = input_.to_physical.first;
    const InsideBits& bits = input_.bits;
    const auto nearest = [&](std::size_t axis) { return std::llround(index[axis]) - first[axis]; };
    return {nearest(2) + bits.first_z, nearest(1) + bits.first_y, nearest(0) + bits.first_x};
}

template <class F>
bool SnapExceptions::for_each_sample_around(const Mesh& mesh, const Triangle& triangle, std::int64_t rings,
                                            const F& f) const {
    for (const std::uint32_t p : triangle) {
        const auto [z, y, x] = sample_nearest_to(mesh.points[p]);
        for (std::int64_t k = z - rings; k <= z + rings; ++k) {
            for (std::int64_t j = y - rings; j <= y + rings; ++j) {
                for (std::int64_t i = x - rings; i <= x + rings; ++i)
                    if (!f(Sample{k, j, i})) return false;
            }
        }
    }
    return true;
}

void SnapExceptions::add(const Mesh& mesh, const Triangle& triangle, std::int64_t rings) {
    std::set<Sample> samples;  // those around two corners count once
    for_each_sample_around(mesh, triangle, rings, [&](const Sample& sample) {
        samples.insert(sample);
        return true;
    });
    for (const Sample& sample : samples) {
        changed_slices_.insert(sample[0]);
        if (!unmerged_.insert(sample).second) unwidened_.insert(sample);
    }
}

// A point is less than an edge away from its sample, and a corner of a cap from where it was before: both
// are among the samples next to the nearest one, and with room for rounding among those after next.
bool SnapExceptions::are_exhausted(const Mesh& mesh, const Triangle& triangle) const {
    return for_each_sample_around(mesh, triangle, 2,
                                  [&](const Sample& sample) { return unwidened_.count(sample) > 0; });
}

void SnapExceptions::forbid_merging(const SliceMerge& merge) const {
    if (unmerged_.empty()) return;
    const Clusters& list = merge.clusters;
    for (std::size_t i = 0; i < list.word_count; ++i) {
        const ClusterWord& word = list.words[i];
        Cluster* cluster = merge.clusters.clusters.data() + word.first_cluster;
        for_each_bit(word.clusters, [&](std::uint32_t bit) {
            const std::int64_t x = word.first_x + input_.bits.first_x + static_cast<std::int64_t>(bit);
            if (unmerged_.count({merge.z, word.y, x}) > 0) cluster->merges = false;
            ++cluster;
        });
    }
}

}  // namespace marrow::internal
