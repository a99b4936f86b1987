// Counts the faults of a mesh, and measures its thin walls.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <numeric>
#include <vector>

#include <marrow/error.h>
#include <marrow/mesh_check.h>

#include "base/disjoint_sets.h"
#include "base/for_each_range.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "base/three_corners.h"
#include "component_around.h"
#include "find_components.h"
#include "mesh/connectivity/check_mesh.h"
#include "mesh/connectivity/count_edges.h"
#include "mesh/connectivity/one_rings.h"
#include "mesh/connectivity/vertex_triangles.h"
#include "mesh/geometry/triangle_corners.h"
#include "mesh/intersections/self_intersections.h"
#include "mesh/search/triangle_tree.h"

namespace marrow {

using namespace internal;

namespace {

constexpr std::size_t kGrain = 8192;  // triangles

void check_input(const MeshView& mesh, const CheckOptions& options) {
    if (options.min_wall && !(*options.min_wall >= 0))
        throw InputError("check: the smallest wall must be a number of mm from 0 upwards");
    check_arrays(mesh);
    check_triangle_count(mesh, "check");
    check_coordinates(mesh.points);
}

// Whether the triangles at a point are connected through the edges at that point.
bool is_one_fan(const Triangle* begin, const Triangle* end) {
    if (is_closed_fan(begin, end)) return true;
    struct Spoke {
        std::uint32_t to;
        std::size_t triangle;
    };
    const auto count = static_cast<std::size_t>(end - begin);
    std::vector<Spoke> spokes;
    for (std::size_t i = 0; i < count; ++i) {
        for (const std::uint32_t to : {begin[i][1], begin[i][2]}) spokes.push_back({to, i});
    }
    std::sort(spokes.begin(), spokes.end(), [](const Spoke& a, const Spoke& b) { return a.to < b.to; });
    std::vector<std::size_t> parents(count);
    std::iota(parents.begin(), parents.end(), std::size_t{0});
    std::size_t fans = count;
    for (std::size_t i = 1; i < spokes.size(); ++i) {
        if (spokes[i].to == spokes[i - 1].to)
            fans -= unite(parents, spokes[i - 1].triangle, spokes[i].triangle) ? 1 : 0;
    }
    return fans <= 1;
}

// Only the points that are not closed fans can be at fault.
void count_faulty_points(const MeshView& mesh, const OneRings& rings, MeshCheck& check) {
    std::vector<std::uint32_t> not_in_closed_fans;
    for (std::size_t chunk = 0; chunk < rings.chunks(); ++chunk) {
        for (const std::uint32_t p : rings.listed(chunk, 0)) {
            if (rings.of(p).empty())
                ++check.unused_points;
            else
                not_in_closed_fans.push_back(p);
        }
    }
    if (not_in_closed_fans.empty()) return;
    const VertexTriangles vertex_triangles(mesh);
    for (const std::uint32_t p : not_in_closed_fans)
        check.nonmanifold_points += !is_one_fan(vertex_triangles.begin(p), vertex_triangles.end(p));
}

std::int64_t count_triangles_without_area(const MeshView& mesh) {
    return parallel_reduce(
        std::size_t{0}, mesh.triangles.size(), kGrain, std::int64_t{0},
        [&](const auto& range, std::int64_t count) {
            for (std::size_t t = range.begin(); t < range.end(); ++t)
                count += area(corners_of(mesh, mesh.triangles[t])) == 0;
            return count;
        },
        [](std::int64_t a, std::int64_t b) { return a + b; });
}

// Returns for each triangle the length of the ray from its centre inward until it leaves the object; infinity
// from `min_wall` on.
std::vector<double> wall_thickness(const MeshView& mesh, double min_wall, const Progress& progress,
                                   double begin, double end) {
    const TriangleTree tree(mesh);
    std::vector<double> thickness(mesh.triangles.size(), std::numeric_limits<double>::infinity());
    const auto measure_wall = [&](std::size_t i) {
        const TriangleCorners t = corners_of(mesh, mesh.triangles[i]);
        const Vec3d outward = scaled_normal(t);
        const double size = length(outward);
        if (size == 0) return;
        const Vec3d inward = (-1 / size) * outward;
        const double least = 1e-6 * std::sqrt(size);  // what is nearer is another body that touches this one
        tree.for_each_hit(centroid(t), inward, min_wall, [&](double distance, std::uint32_t j) {
            const bool leaves = dot(scaled_normal(corners_of(mesh, mesh.triangles[j])), inward) > 0;
            if (j != i && leaves && distance > least && distance < min_wall)
                thickness[i] = std::min(thickness[i], distance);
        });
    };
    for_each_range(mesh.triangles.size(), 1024, progress, begin, end,
                   [&](std::size_t first, std::size_t last) {
                       for (std::size_t i = first; i < last; ++i) measure_wall(i);
                   });
    return thickness;
}

void check_walls(const MeshView& mesh, const std::vector<double>& thickness, MeshCheck& check) {
    for (std::size_t i = 0; i < thickness.size(); ++i) {
        if (!std::isfinite(thickness[i])) continue;
        check.thinnest_wall = std::min(check.thinnest_wall.value_or(thickness[i]), thickness[i]);
        ++check.thin_triangles;
        check.thin_area += area(corners_of(mesh, mesh.triangles[i]));
    }
}

// Counts the components that face inward and are in none, or in a cavity.
std::int64_t count_inverted(const MeshView& mesh, const Components& components) {
    std::vector<const Component*> cavities;
    for (const Component& c : components.all) {
        if (c.is_cavity()) cavities.push_back(&c);
    }
    if (cavities.empty()) return 0;
    const TriangleTree tree(mesh);
    return parallel_reduce(
        std::size_t{0}, cavities.size(), 1, std::int64_t{0},
        [&](const auto& range, std::int64_t count) {
            for (std::size_t c = range.begin(); c < range.end(); ++c) {
                const std::uint32_t around = component_around(*cavities[c], mesh, components, tree);
                count += around == Components::kNone || components.all[around].is_cavity();
            }
            return count;
        },
        [](std::int64_t a, std::int64_t b) { return a + b; });
}

// The counts are independent, so they run at the same time.
// \pre no triangle has equal indices
void check_surface(const MeshView& mesh, const CheckOptions& options, MeshCheck& check) {
    const double walls_begin = options.min_wall ? 0.6 : 1;
    const OneRings rings(mesh);
    report_progress(options.progress, 0);  // so that the check can be cancelled here
    parallel_invoke(
        [&] {
            check.self_intersections = static_cast<std::int64_t>(
                find_self_intersections(mesh, rings, options.progress, 0, walls_begin).size());
        },
        [&] {
            const EdgeCounts edges = count_edges(mesh, rings);
            check.misoriented_edges = edges.misoriented;
            const Components components = find_components(mesh, rings);
            check.measures = measure_components(mesh, components, edges);
            // A cavity may be in an open component without being seen to be.
            if (check.is_closed()) check.inverted_components = count_inverted(mesh, components);
        },
        [&] { check.degenerate_triangles += count_triangles_without_area(mesh); },
        [&] { count_faulty_points(mesh, rings, check); });
    check.cavities = check.measures.cavities;
    const MeshMeasures& m = check.measures;
    if (check.is_closed() && check.is_manifold() && check.misoriented_edges == 0)
        check.genus = m.components - (m.euler_characteristic - check.unused_points) / 2;
    if (options.min_wall && !mesh.triangles.empty())
        check_walls(mesh, wall_thickness(mesh, *options.min_wall, options.progress, walls_begin, 1), check);
}

}  // namespace

MeshCheck check_mesh(MeshView mesh, const CheckOptions& options) {
    check_input(mesh, options);
    MeshCheck check;
    if (std::all_of(mesh.triangles.begin(), mesh.triangles.end(), has_three_corners)) {
        with_threads(options.threads, [&] { check_surface(mesh, options, check); });
        return check;
    }
    std::vector<Triangle> cleaned;
    std::copy_if(mesh.triangles.begin(), mesh.triangles.end(), std::back_inserter(cleaned),
                 has_three_corners);
    check.degenerate_triangles = static_cast<std::int64_t>(mesh.triangles.size() - cleaned.size());
    with_threads(options.threads, [&] { check_surface({mesh.points, cleaned}, options, check); });
    return check;
}

std::vector<MeshCrossing> find_crossings(std::span<const MeshView> meshes, const CheckOptions& options) {
    std::vector<Vec3f> points;
    std::vector<Triangle> triangles;
    std::vector<std::size_t> mesh_of;  // of each triangle
    for (std::size_t m = 0; m < meshes.size(); ++m) {
        check_input(meshes[m], options);
        if ((std::uint64_t{points.size()} + meshes[m].points.size()) >> 32)
            throw LimitError("check: the meshes have 2^32 points or more");
        const auto first = static_cast<std::uint32_t>(points.size());
        points.insert(points.end(), meshes[m].points.begin(), meshes[m].points.end());
        for (const Triangle& t : meshes[m].triangles) {
            if (!has_three_corners(t)) continue;
            triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
            mesh_of.push_back(m);
        }
    }
    if (std::uint64_t{triangles.size()} >> 32)
        throw LimitError("check: the meshes have 2^32 triangles or more");
    std::map<std::pair<std::size_t, std::size_t>, std::int64_t> pairs;
    with_threads(options.threads, [&] {
        const MeshView all(points, triangles);
        for (const auto& [i, j] : find_self_intersections(all, OneRings(all), options.progress)) {
            if (mesh_of[i] != mesh_of[j]) ++pairs[{mesh_of[i], mesh_of[j]}];
        }
    });
    std::vector<MeshCrossing> crossings;
    for (const auto& [which, count] : pairs) crossings.push_back({which.first, which.second, count});
    return crossings;
}

}  // namespace marrow
