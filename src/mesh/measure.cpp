#include <marrow/measure.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "check_mesh.h"
#include "components.h"

namespace marrow {

namespace {

// A half-edge seen from its lower point: to which higher point, and whether the triangle runs up or down it.
struct HalfEdge {
    std::uint32_t higher;
    bool upward;
};

// Half-edges bucketed by their lower point: those of point p are half_edges[start[p]] to half_edges[start[p +
// 1]].
struct HalfEdges {
    std::vector<std::size_t> start;
    std::vector<HalfEdge> half_edges;
};

HalfEdges bucket_half_edges(const Mesh& mesh) {
    HalfEdges result;
    result.start.assign(mesh.points.size() + 2, 0);
    const auto for_each = [&](auto&& f) {
        for (const Triangle& t : mesh.triangles) {
            for (std::size_t c = 0; c < 3; ++c) f(t[c], t[(c + 1) % 3]);
        }
    };
    // Counted two slots on, so that filling leaves start[p] at the begin of p's bucket.
    for_each([&](std::uint32_t a, std::uint32_t b) { ++result.start[std::min(a, b) + std::size_t{2}]; });
    std::partial_sum(result.start.begin(), result.start.end(), result.start.begin());
    result.half_edges.resize(3 * mesh.triangles.size());
    for_each([&](std::uint32_t a, std::uint32_t b) {
        result.half_edges[result.start[std::min(a, b) + std::size_t{1}]++] = {std::max(a, b), a < b};
    });
    return result;
}

void count_edges(const Mesh& mesh, MeshMeasures& measures) {
    HalfEdges h = bucket_half_edges(mesh);
    std::int64_t edges = 0;
    for (std::size_t p = 0; p < mesh.points.size(); ++p) {
        const auto begin = h.half_edges.begin() + static_cast<std::ptrdiff_t>(h.start[p]);
        const auto end = h.half_edges.begin() + static_cast<std::ptrdiff_t>(h.start[p + 1]);
        std::sort(begin, end, [](HalfEdge a, HalfEdge b) { return a.higher < b.higher; });
        for (auto edge = begin; edge != end;) {
            int up = 0, down = 0;
            const std::uint32_t higher = edge->higher;
            for (; edge != end && edge->higher == higher; ++edge) ++(edge->upward ? up : down);
            ++edges;
            if (up + down == 1)
                ++measures.boundary_edges;
            else if (up != 1 || down != 1)
                ++measures.nonmanifold_edges;
        }
    }
    measures.euler_characteristic = measures.points - edges + measures.triangles;
}

std::int64_t count_components(const Mesh& mesh) {
    std::vector<bool> used(mesh.points.size(), false);
    for (const Triangle& t : mesh.triangles) {
        for (std::uint32_t p : t) used[p] = true;
    }
    const std::vector<std::uint32_t> lowest = internal::lowest_connected_points(mesh);
    std::int64_t components = 0;
    for (std::uint32_t p = 0; p < lowest.size(); ++p) components += used[p] && lowest[p] == p;
    return components;
}

void sum_area_and_volume(const Mesh& mesh, MeshMeasures& measures) {
    // About the first point, so that far-away coordinates do not cancel.
    const Vec3f origin = mesh.points.empty() ? Vec3f{} : mesh.points.front();
    const auto corner = [&](std::uint32_t p, std::size_t axis) {
        return static_cast<double>(mesh.points[p][axis]) - static_cast<double>(origin[axis]);
    };
    for (const Triangle& t : mesh.triangles) {
        double a[3], u[3], v[3];
        for (std::size_t axis = 0; axis < 3; ++axis) {
            a[axis] = corner(t[0], axis);
            u[axis] = corner(t[1], axis) - a[axis];
            v[axis] = corner(t[2], axis) - a[axis];
        }
        const double cross[3] = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2],
                                 u[0] * v[1] - u[1] * v[0]};
        measures.area += std::sqrt(cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]) / 2;
        measures.volume += (a[0] * cross[0] + a[1] * cross[1] + a[2] * cross[2]) / 6;
    }
}

}  // namespace

MeshMeasures measure(const Mesh& mesh) {
    MeshMeasures m;
    m.points = static_cast<std::int64_t>(mesh.points.size());
    m.triangles = static_cast<std::int64_t>(mesh.triangles.size());
    internal::check_triangles(mesh);
    count_edges(mesh, m);
    m.components = count_components(mesh);
    sum_area_and_volume(mesh, m);
    if (!mesh.points.empty()) m.lower = m.upper = mesh.points.front();
    for (const Vec3f& p : mesh.points) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            m.lower[axis] = std::min(m.lower[axis], p[axis]);
            m.upper[axis] = std::max(m.upper[axis], p[axis]);
        }
    }
    return m;
}

}  // namespace marrow
