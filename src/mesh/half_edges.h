/// Lists the edges of a mesh and counts the triangles along each.
#pragma once

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

#include <marrow/mesh.h>

namespace marrow::internal {

/// A half-edge as seen from its lower point: its higher point, and whether its triangle runs from lower to
/// higher.
struct HalfEdge {
    std::uint32_t higher;
    bool upward;
};

/// Half-edges sorted by their lower point: point p has half_edges[start[p]] to half_edges[start[p + 1] - 1].
struct HalfEdges {
    std::vector<std::size_t> start;
    std::vector<HalfEdge> half_edges;
};

/// Takes linear time. \pre indices are in range
inline HalfEdges bucket_half_edges(const MeshView& mesh) {
    HalfEdges result;
    result.start.assign(mesh.points.size() + 2, 0);
    const auto for_each = [&](auto&& f) {
        for (const Triangle& t : mesh.triangles) {
            for (std::size_t c = 0; c < 3; ++c) f(t[c], t[(c + 1) % 3]);
        }
    };
    // Counts go two entries further, so that filling leaves the first half-edge of p in start[p].
    for_each([&](std::uint32_t a, std::uint32_t b) { ++result.start[std::min(a, b) + std::size_t{2}]; });
    std::partial_sum(result.start.begin(), result.start.end(), result.start.begin());
    result.half_edges.resize(3 * mesh.triangles.size());
    for_each([&](std::uint32_t a, std::uint32_t b) {
        result.half_edges[result.start[std::min(a, b) + std::size_t{1}]++] = {std::max(a, b), a < b};
    });
    return result;
}

/// An edge between two points, with the number of triangles that run along it in each direction.
struct Edge {
    std::uint32_t lower, higher;
    std::int64_t up, down;  ///< from lower to higher, and from higher to lower

    bool is_border() const { return up + down == 1; }
    bool is_manifold() const { return up == 1 && down == 1; }
};

/// Calls f(Edge) for every edge, ordered by its points. \pre indices are in range
template <class F>
void for_each_edge(const MeshView& mesh, F f) {
    HalfEdges h = bucket_half_edges(mesh);
    for (std::uint32_t p = 0; p < mesh.points.size(); ++p) {
        const auto begin = h.half_edges.begin() + static_cast<std::ptrdiff_t>(h.start[p]);
        const auto end = h.half_edges.begin() + static_cast<std::ptrdiff_t>(h.start[p + std::size_t{1}]);
        std::sort(begin, end, [](HalfEdge a, HalfEdge b) { return a.higher < b.higher; });
        for (auto half = begin; half != end;) {
            Edge edge{p, half->higher, 0, 0};
            for (; half != end && half->higher == edge.higher; ++half) ++(half->upward ? edge.up : edge.down);
            f(edge);
        }
    }
}

}  // namespace marrow::internal
