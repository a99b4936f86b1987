// Counts and sums over all edges, components and triangles of a mesh.
#include <marrow/measure.h>

#include <vector>

#include "bounds.h"
#include "check_indices.h"
#include "find_components.h"
#include "triangle_corners.h"

namespace marrow {

using namespace internal;

namespace {

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
    return measure_components(mesh, find_components(mesh));
}

namespace internal {

MeshMeasures measure_components(const MeshView& mesh, const Components& components) {
    MeshMeasures m;
    m.points = static_cast<std::int64_t>(mesh.points.size());
    m.triangles = static_cast<std::int64_t>(mesh.triangles.size());
    m.boundary_edges = components.edges.boundary;
    m.nonmanifold_edges = components.edges.nonmanifold;
    m.euler_characteristic = m.points - components.edges.all + m.triangles;
    m.components = static_cast<std::int64_t>(components.all.size());
    for (const Component& component : components.all) m.cavities += component.is_cavity();
    sum_area_and_volume(mesh, m);
    if (mesh.points.empty()) return m;
    Bounds bounds{mesh.points.front(), mesh.points.front()};
    for (const Vec3f& p : mesh.points) bounds.include(p);
    m.lower = bounds.lower;
    m.upper = bounds.upper;
    return m;
}

}  // namespace internal
}  // namespace marrow
