// Sorts the half-edges between irregular points by their lower points, and counts those of each edge.
#include "irregular_edges.h"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <span>

namespace marrow::internal {

namespace {

// A half-edge at its lower point.
struct HalfEdge {
    std::uint32_t higher;
    bool upward;  // whether its triangle runs from lower to higher
};

// Each point is its own lower one if its triangle has it twice.
void list_edges_of(std::uint32_t lower, std::span<HalfEdge> half_edges, std::vector<Edge>& edges) {
    std::sort(half_edges.begin(), half_edges.end(),
              [](const HalfEdge& a, const HalfEdge& b) { return a.higher < b.higher; });
    for (auto half = half_edges.begin(); half != half_edges.end();) {
        Edge edge{lower, half->higher};
        for (; half != half_edges.end() && half->higher == edge.higher; ++half)
            ++(half->upward ? edge.up : edge.down);
        if (!edge.is_manifold()) edges.push_back(edge);
    }
}

}  // namespace

// Only both ends of an edge that is not manifold are irregular.
std::vector<Edge> irregular_edges(const OneRings& rings) {
    std::vector<std::uint32_t> irregular;
    for (std::size_t chunk = 0; chunk < rings.chunks(); ++chunk) {
        for (const std::uint32_t p : rings.listed(chunk, 0)) {
            if (!rings.is_regular(p)) irregular.push_back(p);
        }
    }
    if (irregular.empty()) return {};
    const auto for_each_half_edge = [&](const auto& f) {
        for (const std::uint32_t p : irregular) {
            for (const std::uint32_t q : rings.of(p)) {
                if (!rings.is_regular(q)) f(p, q);
            }
        }
    };
    // Counts go two entries further, so that filling leaves the first half-edge of p in start[p].
    std::vector<std::size_t> start(rings.size() + 2, 0);
    for_each_half_edge([&](std::uint32_t p, std::uint32_t q) { ++start[std::min(p, q) + std::size_t{2}]; });
    std::partial_sum(start.begin(), start.end(), start.begin());
    std::vector<HalfEdge> half_edges(start.back());
    for_each_half_edge([&](std::uint32_t p, std::uint32_t q) {
        half_edges[start[std::min(p, q) + std::size_t{1}]++] = {std::max(p, q), p < q};
    });
    std::vector<Edge> edges;
    for (const std::uint32_t p : irregular)
        list_edges_of(p, std::span(half_edges).subspan(start[p], start[p + std::size_t{1}] - start[p]),
                      edges);
    return edges;
}

}  // namespace marrow::internal
