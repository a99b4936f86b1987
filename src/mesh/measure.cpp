#include <marrow/measure.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "check_indices.h"
#include "components.h"
#include "half_edges.h"

namespace marrow {

namespace {

void count_edges(const Mesh& mesh, MeshMeasures& measures) {
    std::int64_t edges = 0;
    internal::for_each_edge(mesh, [&](const internal::Edge& edge) {
        ++edges;
        if (edge.is_border())
            ++measures.boundary_edges;
        else if (!edge.is_manifold())
            ++measures.nonmanifold_edges;
    });
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
