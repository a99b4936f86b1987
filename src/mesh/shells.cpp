#include "shells.h"

#include "components.h"
#include "half_edges.h"
#include "vector.h"

namespace marrow::internal {

Shells find_shells(const Mesh& mesh) {
    Shells shells;
    const std::vector<std::uint32_t> lowest = lowest_connected_points(mesh);
    std::vector<std::uint32_t>& of_point = shells.of_point;
    of_point.assign(mesh.points.size(), Shells::kNoShell);
    for (const Triangle& t : mesh.triangles) of_point[lowest[t[0]]] = 0;
    // A shell's lowest point comes before its others, so that one pass numbers the shells and all their points.
    std::uint32_t count = 0;
    for (std::size_t p = 0; p < of_point.size(); ++p) {
        if (lowest[p] != p)
            of_point[p] = of_point[lowest[p]];
        else if (of_point[p] != Shells::kNoShell)
            of_point[p] = count++;
    }

    shells.all.resize(count);
    std::vector<Vec3d> origins(count);  // so that far-away coordinates do not cancel
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        const Triangle& t = mesh.triangles[i];
        Shell& shell = shells.all[shells.of(t)];
        Vec3d& origin = origins[shells.of(t)];
        if (shell.triangles++ == 0) {
            shell.first_triangle = static_cast<std::uint32_t>(i);
            origin = to_double(mesh.points[t[0]]);
        }
        const Corners corners(mesh, t);
        shell.volume += dot(corners.a - origin, cross(corners.b - origin, corners.c - origin)) / 6;
    }
    for_each_edge(mesh, [&](const Edge& edge) {
        if (!edge.is_manifold()) shells.all[of_point[edge.lower]].closed = false;
    });
    return shells;
}

}  // namespace marrow::internal
