// Counts and sums over all edges, components and triangles of a mesh.
#include <algorithm>
#include <cstdint>

#include <marrow/measure.h>

#include "base/parallel.h"
#include "find_components.h"
#include "mesh/connectivity/check_mesh.h"
#include "mesh/connectivity/count_edges.h"
#include "mesh/geometry/bounds.h"
#include "mesh/geometry/triangle_corners.h"

namespace marrow {

using namespace internal;

namespace {

constexpr std::size_t kGrain = 8192;  // triangles; decides the last bits of sums

// The first point that a triangle has. In most meshes it is that of number 0, in one of the first triangles.
Vec3d first_corner(const MeshView& mesh) {
    std::uint32_t first = ~std::uint32_t{0};
    for (const Triangle& t : mesh.triangles) {
        first = std::min({first, t[0], t[1], t[2]});
        if (first == 0) break;
    }
    return mesh.triangles.empty() ? Vec3d{} : to_double(mesh.points[first]);
}

// Relative to a point of the surface, because distant coordinates would cancel.
AreaAndVolume sum_area_and_volume(const MeshView& mesh) {
    const Vec3d origin = first_corner(mesh);
    return parallel_reduce(
        std::size_t{0}, mesh.triangles.size(), kGrain, AreaAndVolume{},
        [&](const auto& range, AreaAndVolume sums) {
            for (std::size_t t = range.begin(); t < range.end(); ++t) {
                TriangleCorners corners = corners_of(mesh, mesh.triangles[t]);
                for (Vec3d& corner : corners) corner = corner - origin;
                const Vec3d normal = scaled_normal(corners);
                sums.area += length(normal) / 2;
                sums.volume += dot(corners[0], normal) / 6;
            }
            return sums;
        },
        [](const AreaAndVolume& a, const AreaAndVolume& b) {
            return AreaAndVolume{a.area + b.area, a.volume + b.volume};
        });
}

}  // namespace

MeshMeasures measure(MeshView mesh, const MeasureOptions& options) {
    check_arrays(mesh);
    MeshMeasures measures;
    with_threads(options.threads, [&] {
        const OneRings rings(mesh);
        measures = measure_components(mesh, find_components(mesh, rings), count_edges(mesh, rings));
    });
    return measures;
}

AreaAndVolume area_and_volume(MeshView mesh, const MeasureOptions& options) {
    check_arrays(mesh);
    AreaAndVolume sums;
    with_threads(options.threads, [&] { sums = sum_area_and_volume(mesh); });
    return sums;
}

namespace internal {

MeshMeasures measure_components(const MeshView& mesh, const Components& components, const EdgeCounts& edges) {
    MeshMeasures m;
    m.points = static_cast<std::int64_t>(mesh.points.size());
    m.triangles = static_cast<std::int64_t>(mesh.triangles.size());
    m.boundary_edges = edges.boundary;
    m.nonmanifold_edges = edges.nonmanifold;
    m.euler_characteristic = m.points - edges.all + m.triangles;
    m.components = static_cast<std::int64_t>(components.all.size());
    for (const Component& component : components.all) m.cavities += component.is_cavity();
    const AreaAndVolume sums = sum_area_and_volume(mesh);
    m.area = sums.area;
    m.volume = sums.volume;
    if (mesh.points.empty()) return m;
    // With the first point, so that coordinates which are all NaN have no bounds of infinity.
    Bounds bounds{mesh.points.front(), mesh.points.front()};
    bounds.include(bounds_of(mesh.points));
    m.lower = bounds.lower;
    m.upper = bounds.upper;
    return m;
}

}  // namespace internal
}  // namespace marrow
