// Counts and sums over all edges, components and triangles of a mesh.
#include <marrow/measure.h>

#include <vector>

#include "base/parallel.h"
#include "bounds.h"
#include "check_indices.h"
#include "find_components.h"
#include "triangle_corners.h"

namespace marrow {

using namespace internal;

namespace {

struct Sums {
    double area = 0, volume = 0;
};

// Relative to the first point, because distant coordinates would cancel.
Sums sum_area_and_volume(const MeshView& mesh) {
    const Vec3d origin = mesh.points.empty() ? Vec3d{} : to_double(mesh.points.front());
    return parallel_reduce(
        std::size_t{0}, mesh.triangles.size(), 8192, Sums{},
        [&](const auto& range, Sums sums) {
            for (std::size_t t = range.begin(); t < range.end(); ++t) {
                TriangleCorners corners = corners_of(mesh, mesh.triangles[t]);
                for (Vec3d& corner : corners) corner = corner - origin;
                const Vec3d normal = scaled_normal(corners);
                sums.area += length(normal) / 2;
                sums.volume += dot(corners[0], normal) / 6;
            }
            return sums;
        },
        [](const Sums& a, const Sums& b) {
            return Sums{a.area + b.area, a.volume + b.volume};
        });
}

// Each half-edge of a triangle belongs to an edge, and each edge that is not irregular has two.
void count_edges(const std::vector<Edge>& irregular, MeshMeasures& m) {
    std::int64_t half_edges_of_irregular = 0;
    for (const Edge& edge : irregular) {
        half_edges_of_irregular += edge.up + edge.down;
        ++(edge.is_border() ? m.boundary_edges : m.nonmanifold_edges);
    }
    const std::int64_t edges =
        (3 * m.triangles - half_edges_of_irregular) / 2 + static_cast<std::int64_t>(irregular.size());
    m.euler_characteristic = m.points - edges + m.triangles;
}

}  // namespace

MeshMeasures measure(MeshView mesh, const MeasureOptions& options) {
    check_indices(mesh);
    MeshMeasures measures;
    with_threads(options.threads, [&] {
        const std::vector<Edge> edges = irregular_edges(OneRings(mesh));
        measures = measure_components(mesh, find_components(mesh, edges), edges);
    });
    return measures;
}

namespace internal {

MeshMeasures measure_components(const MeshView& mesh, const Components& components,
                                const std::vector<Edge>& edges) {
    MeshMeasures m;
    m.points = static_cast<std::int64_t>(mesh.points.size());
    m.triangles = static_cast<std::int64_t>(mesh.triangles.size());
    count_edges(edges, m);
    m.components = static_cast<std::int64_t>(components.all.size());
    for (const Component& component : components.all) m.cavities += component.is_cavity();
    const Sums sums = sum_area_and_volume(mesh);
    m.area = sums.area;
    m.volume = sums.volume;
    if (mesh.points.empty()) return m;
    const Bounds bounds = bounds_of(mesh.points);
    m.lower = bounds.lower;
    m.upper = bounds.upper;
    return m;
}

}  // namespace internal
}  // namespace marrow
