// Numbers the components of a mesh, and sums up their triangles, volumes and edges.
#include "find_components.h"

#include "connected_points.h"
#include "half_edges.h"
#include "triangle_corners.h"

namespace marrow::internal {

Components find_components(const MeshView& mesh, bool edges_are_manifold) {
    Components components;
    const std::vector<std::uint32_t> lowest = lowest_connected_points(mesh);
    std::vector<std::uint32_t>& of_point = components.of_point;
    of_point.assign(mesh.points.size(), Components::kNone);
    for (const Triangle& t : mesh.triangles) of_point[lowest[t[0]]] = 0;
    // The lowest point of a component precedes its other points, so one pass numbers all points.
    std::uint32_t count = 0;
    for (std::size_t p = 0; p < of_point.size(); ++p) {
        if (lowest[p] != p)
            of_point[p] = of_point[lowest[p]];
        else if (of_point[p] != Components::kNone)
            of_point[p] = count++;
    }

    components.all.resize(count);
    // Volumes are computed relative to a point of the component, because distant coordinates would cancel.
    std::vector<Vec3d> origins(count);
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        const Triangle& t = mesh.triangles[i];
        Component& component = components.all[components.of(t)];
        Vec3d& origin = origins[components.of(t)];
        if (component.triangles++ == 0) {
            component.first_triangle = static_cast<std::uint32_t>(i);
            origin = to_double(mesh.points[t[0]]);
        }
        const auto [a, b, c] = corners_of(mesh, t);
        component.volume += dot(a - origin, cross(b - origin, c - origin)) / 6;
    }
    EdgeCounts& edges = components.edges;
    if (edges_are_manifold) {
        edges.all = 3 * static_cast<std::int64_t>(mesh.triangles.size()) / 2;
        return components;
    }
    for_each_edge(mesh, [&](const Edge& edge) {
        ++edges.all;
        if (edge.is_manifold()) return;
        ++(edge.is_border() ? edges.boundary : edges.nonmanifold);
        components.all[of_point[edge.lower]].closed = false;
    });
    return components;
}

}  // namespace marrow::internal
