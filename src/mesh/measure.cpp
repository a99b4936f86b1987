// Counts and sums over all edges, components and triangles of a mesh.
#include <marrow/measure.h>

#include <vector>

#include "bounds.h"
#include "check_indices.h"
#include "find_components.h"
#include "half_edges.h"
#include "triangle_corners.h"

namespace marrow {

using namespace internal;

namespace {

void count_edges(const MeshView& mesh, MeshMeasures& measures) {
    std::int64_t edges = 0;
    for_each_edge(mesh, [&](const Edge& edge) {
        ++edges;
        if (edge.is_border())
            ++measures.boundary_edges;
        else if (!edge.is_manifold())
            ++measures.nonmanifold_edges;
    });
    measures.euler_characteristic = measures.points - edges + measures.triangles;
}

// Relative to the first point, because distant coordinates would cancel.
void sum_area_and_volume(const MeshView& mesh, MeshMeasures& measures) {
    if (mesh.points.empty()) return;
    const Vec3d origin = to_double(mesh.points.front());
    for (const Triangle& t : mesh.triangles) {
        TriangleCorners corners = corners_of(mesh, t);
        for (Vec3d& corner : corners) corner = corner - origin;
        const Vec3d normal = scaled_normal(corners);
        measures.area += length(normal) / 2;
        measures.volume += dot(corners[0], normal) / 6;
    }
}

}  // namespace

MeshMeasures measure(MeshView mesh) {
    check_indices(mesh);
    MeshMeasures m;
    m.points = static_cast<std::int64_t>(mesh.points.size());
    m.triangles = static_cast<std::int64_t>(mesh.triangles.size());
    count_edges(mesh, m);
    const std::vector<Component> components = find_components(mesh).all;
    m.components = static_cast<std::int64_t>(components.size());
    for (const Component& component : components) m.cavities += component.is_cavity();
    sum_area_and_volume(mesh, m);
    if (mesh.points.empty()) return m;
    Bounds bounds{mesh.points.front(), mesh.points.front()};
    for (const Vec3f& p : mesh.points) bounds.include(p);
    m.lower = bounds.lower;
    m.upper = bounds.upper;
    return m;
}

}  // namespace marrow
