// Intersects every triangle with the triangles near it, and looks at both sides of edges that intersect a
// triangle.
#include "self_intersections.h"

#include <algorithm>
#include <atomic>
#include <optional>

#include "for_each_range.h"
#include "triangle_intersection.h"

namespace marrow::internal {

namespace {

std::size_t count_shared_points(const Triangle& a, const Triangle& b) {
    return static_cast<std::size_t>(std::count_if(
        a.begin(), a.end(), [&](std::uint32_t p) { return p == b[0] || p == b[1] || p == b[2]; }));
}

// Returns the far corner of the neighbour across the edge opposite to a corner. Returns nothing if the edge
// does not have exactly two triangles.
std::optional<Vec3d> across_edge(const MeshView& mesh, const VertexTriangles& vertex_triangles,
                                 const Triangle& t, std::size_t corner) {
    const std::uint32_t a = t[(corner + 1) % 3], b = t[(corner + 2) % 3];
    std::uint32_t far = t[corner];
    int triangles = 0;
    for (const Triangle* other = vertex_triangles.begin(a); other != vertex_triangles.end(a); ++other) {
        if ((*other)[1] != b && (*other)[2] != b) continue;
        ++triangles;
        const std::uint32_t third = (*other)[1] == b ? (*other)[2] : (*other)[1];
        if (third != t[corner]) far = third;
    }
    if (triangles != 2) return {};
    return to_double(mesh.points[far]);
}

// Whether the surface passes through itself where the triangles i and j intersect.
bool pass_through(const MeshView& mesh, const VertexTriangles& vertex_triangles, std::uint32_t i,
                  std::uint32_t j) {
    const std::size_t shared = count_shared_points(mesh.triangles[i], mesh.triangles[j]);
    if (shared > 1) return false;
    const TriangleCorners s = corners_of(mesh, mesh.triangles[i]), t = corners_of(mesh, mesh.triangles[j]);
    const std::optional<TriangleIntersection> found = intersect(s, t);
    if (!found || found->is_of_interiors()) return found.has_value();
    if (shared > 0) return false;
    // The segment is on an edge. The surface only touches if it continues beyond the edge on the same side.
    const auto beyond = [&](std::uint32_t triangle, const TriangleCorners& corners, const PlaneCut& cut) {
        return cut.is_along_edge() ? across_edge(mesh, vertex_triangles, mesh.triangles[triangle], cut.apex)
                                   : corners[cut.opposite];
    };
    const std::optional<Vec3d> beyond_s = beyond(i, s, found->s), beyond_t = beyond(j, t, found->t);
    if (!beyond_s || !beyond_t) return false;
    const bool on_s = found->s.is_along_edge();
    const TriangleCorners& corners = on_s ? s : t;
    const std::size_t apex = on_s ? found->s.apex : found->t.apex;
    return sheets_cross(corners[(apex + 1) % 3], corners[(apex + 2) % 3], {s[found->s.apex], *beyond_s},
                        {t[found->t.apex], *beyond_t});
}

}  // namespace

std::int64_t count_self_intersections(const MeshView& mesh, const TriangleTree& tree,
                                      const VertexTriangles& vertex_triangles, const Progress& progress,
                                      double begin, double end) {
    std::atomic<std::int64_t> pairs{0};
    for_each_range(
        mesh.triangles.size(), 1024, progress, begin, end, [&](std::size_t first, std::size_t last) {
            std::int64_t found = 0;
            for (std::size_t i = first; i < last; ++i) {
                tree.for_each_in(bounds_of(mesh, mesh.triangles[i]), [&](std::uint32_t j) {
                    found += j > i && pass_through(mesh, vertex_triangles, static_cast<std::uint32_t>(i), j);
                });
            }
            if (found) pairs.fetch_add(found, std::memory_order_relaxed);
        });
    return pairs;
}

}  // namespace marrow::internal
