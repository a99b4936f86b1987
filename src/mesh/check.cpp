#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include <marrow/error.h>
#include <marrow/mesh_check.h>

#include "base/progress.h"
#include "check_indices.h"
#include "half_edges.h"
#include "shells.h"
#include "triangle_intersection.h"
#include "triangle_tree.h"
#include "vector.h"
#include "vertex_triangles.h"

namespace marrow {

using namespace internal;

namespace {

bool names_a_point_twice(const Triangle& t) {
    return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
}

// Whether the triangles at a point hang together along the edges from it.
bool is_one_fan(const Triangle* begin, const Triangle* end) {
    struct Spoke {
        std::uint32_t to;
        std::size_t triangle;
    };
    std::vector<Spoke> spokes;
    std::vector<std::size_t> parent;
    for (const Triangle* t = begin; t != end; ++t) {
        for (const std::uint32_t to : {(*t)[1], (*t)[2]}) spokes.push_back({to, parent.size()});
        parent.push_back(parent.size());
    }
    std::sort(spokes.begin(), spokes.end(), [](const Spoke& a, const Spoke& b) { return a.to < b.to; });
    const auto root = [&](std::size_t t) {
        while (parent[t] != t) t = parent[t] = parent[parent[t]];
        return t;
    };
    std::size_t parts = parent.size();
    for (std::size_t i = 1; i < spokes.size(); ++i) {
        if (spokes[i].to != spokes[i - 1].to) continue;
        const std::size_t a = root(spokes[i - 1].triangle), b = root(spokes[i].triangle);
        if (a == b) continue;
        parent[a] = b;
        --parts;
    }
    return parts <= 1;
}

void check_points(const Mesh& mesh, const Fans& fans, MeshCheck& check) {
    for (std::size_t p = 0; p < mesh.points.size(); ++p) {
        if (fans.begin(p) == fans.end(p))
            ++check.unused_points;
        else if (!is_one_fan(fans.begin(p), fans.end(p)))
            ++check.nonmanifold_points;
    }
}

// Calls f(triangle) for all, on all threads, and reports between.
template <class F>
void for_each_triangle(const Mesh& mesh, const Progress& progress, double from, double until, F f) {
    constexpr std::size_t kPart = 1 << 15;
    const std::size_t count = mesh.triangles.size();
    for (std::size_t first = 0; first < count; first += kPart) {
        const double done = static_cast<double>(first) / static_cast<double>(count);
        report_progress(progress, from + (until - from) * done);
        tbb::parallel_for(first, std::min(first + kPart, count), f);
    }
}

std::array<Vec3d, 3> corners_of(const Mesh& mesh, std::uint32_t triangle) {
    const Triangle& t = mesh.triangles[triangle];
    return {to_double(mesh.points[t[0]]), to_double(mesh.points[t[1]]), to_double(mesh.points[t[2]])};
}

std::size_t shared_points(const Triangle& a, const Triangle& b) {
    return static_cast<std::size_t>(std::count_if(
        a.begin(), a.end(), [&](std::uint32_t p) { return p == b[0] || p == b[1] || p == b[2]; }));
}

// Where the surface goes on across the edge opposite to a corner of a triangle: the far corner of the only other triangle there.
std::optional<Vec3d> across_edge(const Mesh& mesh, const Fans& fans, const Triangle& t, std::size_t corner) {
    const std::uint32_t a = t[(corner + 1) % 3], b = t[(corner + 2) % 3];
    std::uint32_t far = t[corner];
    int along = 0;
    for (const Triangle* other = fans.begin(a); other != fans.end(a); ++other) {
        if ((*other)[1] != b && (*other)[2] != b) continue;
        ++along;
        const std::uint32_t third = (*other)[1] == b ? (*other)[2] : (*other)[1];
        if (third != t[corner]) far = third;
    }
    if (along != 2) return {};
    return to_double(mesh.points[far]);
}

// Whether the surface passes through itself where the triangles i and j meet.
bool pass_through(const Mesh& mesh, const Fans& fans, std::uint32_t i, std::uint32_t j) {
    const std::size_t shared = shared_points(mesh.triangles[i], mesh.triangles[j]);
    if (shared > 1) return false;
    const std::array<Vec3d, 3> s = corners_of(mesh, i), t = corners_of(mesh, j);
    const std::optional<Meeting> found = meet(s, t);
    if (!found || found->of_insides()) return found.has_value();
    if (shared > 0) return false;
    // Along an edge: whether they only touch there depends on where the surface goes on behind it.
    const auto far_side = [&](std::uint32_t triangle, const std::array<Vec3d, 3>& corners, const Cut& cut) {
        return cut.along_edge() ? across_edge(mesh, fans, mesh.triangles[triangle], cut.alone)
                                : corners[cut.beyond];
    };
    const std::optional<Vec3d> beyond_s = far_side(i, s, found->s), beyond_t = far_side(j, t, found->t);
    if (!beyond_s || !beyond_t) return false;
    const bool on_s = found->s.along_edge();
    const std::array<Vec3d, 3>& corners = on_s ? s : t;
    const std::size_t off = on_s ? found->s.alone : found->t.alone;
    return sheets_cross(corners[(off + 1) % 3], corners[(off + 2) % 3], {s[found->s.alone], *beyond_s},
                        {t[found->t.alone], *beyond_t});
}

std::int64_t count_self_intersections(const Mesh& mesh, const TriangleTree& tree, const Fans& fans,
                                      const Progress& progress) {
    std::atomic<std::int64_t> pairs{0};
    for_each_triangle(mesh, progress, 0, 0.6, [&](std::size_t i) {
        std::int64_t found = 0;
        tree.for_each_in(tree.box_of(mesh.triangles[i], mesh), [&](std::uint32_t j) {
            found += j > i && pass_through(mesh, fans, static_cast<std::uint32_t>(i), j);
        });
        if (found) pairs.fetch_add(found, std::memory_order_relaxed);
    });
    return pairs;
}

// How far a ray inwards from each triangle's middle gets; infinite where it is at least min_wall.
std::vector<double> wall_thickness(const Mesh& mesh, const TriangleTree& tree, double min_wall,
                                   const Progress& progress) {
    std::vector<double> thickness(mesh.triangles.size(), std::numeric_limits<double>::infinity());
    for_each_triangle(mesh, progress, 0.6, 1, [&](std::size_t i) {
        const Corners t(mesh, mesh.triangles[i]);
        const Vec3d outward = cross(t.b - t.a, t.c - t.a);
        const double size = length(outward);
        if (size == 0) return;
        const Vec3d inward = (-1 / size) * outward;
        tree.for_each_hit((1.0 / 3) * (t.a + t.b + t.c), inward, min_wall, [&](double at, std::uint32_t j) {
            const Corners other(mesh, mesh.triangles[j]);
            const bool leaves = dot(cross(other.b - other.a, other.c - other.a), inward) > 0;
            if (j != i && leaves && at < min_wall) thickness[i] = std::min(thickness[i], at);
        });
    });
    return thickness;
}

}  // namespace

MeshCheck check_mesh(const Mesh& given, const CheckOptions& options) {
    if (!(options.min_wall >= 0)) throw InputError("check: the least wall must be 0 or more");
    check_triangles(given);
    if (given.triangles.size() >> 32) throw LimitError("check: the mesh has 2^32 triangles or more");
    for (const Vec3f& p : given.points) {
        if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2]))
            throw InputError("check: a point of the mesh is not finite");
    }
    MeshCheck check;
    const bool plain = std::none_of(given.triangles.begin(), given.triangles.end(), names_a_point_twice);
    Mesh without;
    if (!plain) {
        without.points = given.points;
        std::remove_copy_if(given.triangles.begin(), given.triangles.end(),
                            std::back_inserter(without.triangles), names_a_point_twice);
    }
    const Mesh& mesh = plain ? given : without;
    check.degenerate_triangles = static_cast<std::int64_t>(given.triangles.size() - mesh.triangles.size());
    for (const Triangle& t : mesh.triangles) check.degenerate_triangles += Corners(mesh, t).area() == 0;

    check.measures = measure(mesh);
    for_each_edge(mesh, [&](const Edge& e) {
        check.misoriented_edges += e.up + e.down == 2 && (e.up == 2 || e.down == 2);
    });
    const Fans fans(mesh);
    check_points(mesh, fans, check);
    for (const Shell& shell : find_shells(mesh).all) check.cavities += shell.is_cavity();
    const MeshMeasures& m = check.measures;
    if (check.is_closed() && check.is_manifold() && check.misoriented_edges == 0)
        check.genus = m.components - (m.euler_characteristic - check.unused_points) / 2;

    if (mesh.triangles.empty()) return check;
    const TriangleTree tree(mesh);
    check.self_intersections = count_self_intersections(mesh, tree, fans, options.progress);
    if (options.min_wall == 0) return check;
    const std::vector<double> walls = wall_thickness(mesh, tree, options.min_wall, options.progress);
    for (std::size_t i = 0; i < walls.size(); ++i) {
        if (!std::isfinite(walls[i])) continue;
        check.thinnest_wall = check.thin_triangles ? std::min(check.thinnest_wall, walls[i]) : walls[i];
        ++check.thin_triangles;
        check.thin_area += Corners(mesh, mesh.triangles[i]).area();
    }
    return check;
}

}  // namespace marrow
