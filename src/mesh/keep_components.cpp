// Chooses components by size and volume, and copies them into a new mesh.
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

#include <marrow/buffer.h>
#include <marrow/components.h>
#include <marrow/error.h>

#include "base/parallel.h"
#include "mesh/connectivity/check_indices.h"
#include "mesh/connectivity/find_components.h"
#include "mesh/geometry/triangle_corners.h"
#include "mesh/search/triangle_tree.h"

namespace marrow {

using namespace internal;

namespace {

Mesh copy_components(const MeshView& mesh, const Components& components, const std::vector<bool>& keep) {
    const auto is_kept = [&](std::size_t p) {
        return components.of_point[p] != Components::kNone && keep[components.of_point[p]];
    };
    std::size_t points = 0, triangles = 0;
    for (std::size_t p = 0; p < mesh.points.size(); ++p) points += is_kept(p) ? 1 : 0;
    for (std::size_t c = 0; c < keep.size(); ++c)
        triangles += keep[c] ? static_cast<std::size_t>(components.all[c].triangles) : 0;
    Mesh result;
    result.points.reserve(points);
    result.triangles.reserve(triangles);
    if (!mesh.normals.empty()) result.normals.reserve(points);
    Buffer<std::uint32_t> new_index(mesh.points.size());
    for (std::size_t p = 0; p < mesh.points.size(); ++p) {
        if (!is_kept(p)) continue;
        new_index[p] = static_cast<std::uint32_t>(result.points.size());
        result.points.push_back(mesh.points[p]);
        if (!mesh.normals.empty()) result.normals.push_back(mesh.normals[p]);
    }
    for (const Triangle& t : mesh.triangles) {
        if (keep[components.of(t)])
            result.triangles.push_back({new_index[t[0]], new_index[t[1]], new_index[t[2]]});
    }
    return result;
}

// Returns the smallest component around a cavity, or kNone. A ray from the cavity crosses each component
// around it an odd number of times.
std::uint32_t component_around(const Component& cavity, const MeshView& mesh, const Components& components,
                               const TriangleTree& tree) {
    const Vec3d origin = centroid(corners_of(mesh, mesh.triangles[cavity.first_triangle]));
    const Vec3d direction{0.8361, 0.4227, 0.3498};  // not parallel to edges of the sampling grid
    std::map<std::uint32_t, int> crossings;
    tree.for_each_hit(origin, direction, std::numeric_limits<double>::infinity(),
                      [&](double, std::uint32_t t) { ++crossings[components.of(mesh.triangles[t])]; });
    std::uint32_t smallest = Components::kNone;
    for (const auto& [index, count] : crossings) {
        const Component& c = components.all[index];
        if (c.is_cavity() || !c.closed || count % 2 == 0) continue;
        if (smallest == Components::kNone || c.volume < components.all[smallest].volume) smallest = index;
    }
    return smallest;
}

// Of the components marked in `keep`, keeps the `count` largest that are not cavities, and their cavities.
void keep_largest(std::int64_t count, const MeshView& mesh, const Components& components,
                  std::vector<bool>& keep) {
    std::vector<std::uint32_t> solids, cavities;
    for (std::uint32_t c = 0; c < keep.size(); ++c) {
        if (keep[c]) (components.all[c].is_cavity() ? cavities : solids).push_back(c);
    }
    std::stable_sort(solids.begin(), solids.end(), [&](std::uint32_t a, std::uint32_t b) {
        return components.all[a].triangles > components.all[b].triangles;
    });
    for (std::size_t i = static_cast<std::size_t>(count); i < solids.size(); ++i) keep[solids[i]] = false;
    if (cavities.empty()) return;
    const TriangleTree tree(mesh);
    for (const std::uint32_t c : cavities) {
        const std::uint32_t around = component_around(components.all[c], mesh, components, tree);
        keep[c] = around != Components::kNone && keep[around];
    }
}

}  // namespace

Mesh keep_components(MeshView mesh, const ComponentOptions& options) {
    if (options.count && *options.count < 1) throw InputError("components: the count must be at least 1");
    if (!(options.min_volume >= 0))
        throw InputError("components: the smallest volume must be a number of mm^3 from 0 upwards");
    check_indices(mesh);
    Mesh result;
    with_threads(options.threads, [&] {
        const Components components = find_components(mesh, OneRings(mesh));
        std::vector<bool> keep;
        for (const Component& c : components.all) {
            const bool too_small = c.closed && std::abs(c.volume) < options.min_volume;
            keep.push_back(!too_small && (options.cavities || !c.is_cavity()));
        }
        if (options.count) keep_largest(*options.count, mesh, components, keep);
        result = copy_components(mesh, components, keep);
    });
    return result;
}

}  // namespace marrow
