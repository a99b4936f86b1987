// Sorts the half-edges between irregular points by their lower points, and counts those of each edge.
#include "count_edges.h"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <span>

#include <marrow/buffer.h>

namespace marrow::internal {

namespace {

// A half-edge at its lower point.
struct HalfEdge {
    std::uint32_t higher;
    bool upward;  // whether its triangle runs from lower to higher
};

// Adds those of the edges between a point and higher ones that are not manifold, and returns the number of
// their half-edges. A triangle that has a point twice has an edge from it to itself.
std::int64_t add_irregular_edges(std::span<HalfEdge> half_edges, EdgeCounts& counts) {
    std::sort(half_edges.begin(), half_edges.end(),
              [](const HalfEdge& a, const HalfEdge& b) { return a.higher < b.higher; });
    std::int64_t irregular = 0;
    for (auto half = half_edges.begin(); half != half_edges.end();) {
        const std::uint32_t higher = half->higher;
        std::int64_t up = 0, down = 0;
        for (; half != half_edges.end() && half->higher == higher; ++half) ++(half->upward ? up : down);
        if (up == 1 && down == 1) continue;
        ++(up + down == 1 ? counts.boundary : counts.nonmanifold);
        counts.misoriented += up + down == 2;
        irregular += up + down;
    }
    return irregular;
}

}  // namespace

// Both ends of an edge that is not manifold are irregular, so only edges between two irregular points are
// looked at. All others have two half-edges.
EdgeCounts count_edges(const MeshView& mesh, const OneRings& rings) {
    EdgeCounts counts;
    const std::int64_t all_half_edges = 3 * static_cast<std::int64_t>(mesh.triangles.size());
    counts.all = all_half_edges / 2;
    bool all_regular = true;
    rings.for_each_irregular([&](std::uint32_t) { all_regular = false; });
    if (all_regular) return counts;
    const auto for_each_half_edge = [&](const auto& f) {
        rings.for_each_irregular([&](std::uint32_t p) {
            for (const std::uint32_t q : rings.of(p)) {
                if (!rings.is_regular(q)) f(p, q);
            }
        });
    };
    // Counts go two entries further, so that filling leaves the first half-edge of p in start[p].
    Buffer<std::size_t> start(rings.size() + 2);
    std::fill(start.begin(), start.end(), std::size_t{0});
    for_each_half_edge([&](std::uint32_t p, std::uint32_t q) { ++start[std::min(p, q) + std::size_t{2}]; });
    std::partial_sum(start.begin(), start.end(), start.begin());
    Buffer<HalfEdge> half_edges(start.back());
    for_each_half_edge([&](std::uint32_t p, std::uint32_t q) {
        half_edges[start[std::min(p, q) + std::size_t{1}]++] = {std::max(p, q), p < q};
    });
    std::int64_t irregular = 0;
    rings.for_each_irregular([&](std::uint32_t p) {
        irregular += add_irregular_edges(
            std::span(half_edges).subspan(start[p], start[p + std::size_t{1}] - start[p]), counts);
    });
    counts.all = (all_half_edges - irregular) / 2 + counts.boundary + counts.nonmanifold;
    return counts;
}

}  // namespace marrow::internal
