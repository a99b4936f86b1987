#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include <marrow/error.h>
#include <marrow/simplify.h>

#include "check_indices.h"
#include "distance.h"
#include "edge_collapse.h"
#include "normals.h"

namespace marrow {

using namespace internal;

namespace {

// A mesh with fewer triangles, how far it lies from the mesh at first, and which points of that one had to do
// with places that are too far.
struct Attempt {
    Mesh mesh;
    MeshDistance deviation;
    std::vector<std::uint32_t> to_blame;
};

Attempt attempt(const Mesh& mesh, const TriangleTree& tree, const SimplifyOptions& options, double guarded,
                const std::vector<bool>& fixed) {
    const double max_error = options.max_error;
    std::optional<DeviationGuard> guard;
    if (std::isfinite(max_error)) guard.emplace(mesh, tree, guarded);
    EdgeCollapse collapse(mesh, guarded, guard ? &*guard : nullptr);
    for (std::uint32_t p = 0; p < fixed.size(); ++p) {
        if (fixed[p]) collapse.fix(p);
    }
    collapse.reduce_to(static_cast<std::size_t>(options.triangles), options.progress);
    Attempt result;
    std::vector<std::uint32_t> old_triangles;
    result.mesh = collapse.mesh(&old_triangles);
    const TriangleTree new_tree(result.mesh);
    const Distances there = distances(mesh, tree, new_tree, kDistanceSamples, max_error);
    const Distances back = distances(result.mesh, new_tree, tree, kDistanceSamples, max_error);
    result.deviation = symmetric(there, back);
    if (result.deviation.max <= max_error) return result;

    const auto blame = [&](std::uint32_t p) { result.to_blame.push_back(p); };
    const auto blame_corners = [&](std::uint32_t t) {
        for (const std::uint32_t p : mesh.triangles[t]) blame(p);
    };
    for (std::uint32_t p = 0; p < mesh.points.size(); ++p) {
        if (there.points[p] > max_error) blame(p);
    }
    for (const Distances::Place& place : there.places) {
        if (place.distance > max_error) blame_corners(place.triangle);
    }
    for (const Distances::Place& place : back.places) {
        if (place.distance <= max_error) continue;
        blame_corners(tree.nearest(place.place).triangle);
        guard->for_each_point_of(old_triangles[place.triangle], blame);
    }
    for (const Vec3f& p : result.mesh.points) {
        const auto nearest = tree.nearest(to_double(p), max_error);
        if (nearest.distance > max_error) blame_corners(nearest.triangle);
    }
    return result;
}

bool same_topology(const Mesh& a, const Mesh& b) {
    const MeshMeasures m = measure(a), n = measure(b);
    const auto unused = [](const Mesh& mesh) {
        std::vector<bool> used(mesh.points.size(), false);
        for (const Triangle& t : mesh.triangles) used[t[0]] = used[t[1]] = used[t[2]] = true;
        return std::count(used.begin(), used.end(), false);
    };
    return m.components == n.components && m.boundary_edges == n.boundary_edges &&
           m.nonmanifold_edges == n.nonmanifold_edges &&
           m.euler_characteristic - unused(a) == n.euler_characteristic - unused(b);
}

}  // namespace

Mesh simplify(const Mesh& mesh, const SimplifyOptions& options, SimplifyStats* stats) {
    constexpr int kMostAttempts = 8;
    if (options.triangles < 0) throw InputError("simplify: the number of triangles must not be negative");
    if (!(options.max_error > 0)) throw InputError("simplify: the largest error must be above 0");
    check_triangles(mesh);
    if (mesh.triangles.size() >= std::size_t{1} << 30)
        throw LimitError("simplify: the mesh has 2^30 triangles or more");
    SimplifyStats found;
    if (mesh.triangles.size() <= static_cast<std::size_t>(options.triangles)) {
        if (stats) *stats = found;
        return mesh;
    }
    Mesh result;
    if (!std::isfinite(options.max_error) && !stats) {  // nothing to measure
        EdgeCollapse collapse(mesh, options.max_error);
        collapse.reduce_to(static_cast<std::size_t>(options.triangles), options.progress);
        result = collapse.mesh();
    } else {
        // The guard looks at few places of each triangle; the measurement finds the few worse ones between.
        // The next attempt is more careful, and leaves what is round them.
        const TriangleTree tree(mesh);
        std::vector<bool> fixed(mesh.points.size(), false);
        found.backed_off = true;
        for (int i = 0; i < kMostAttempts && found.backed_off; ++i) {
            const double guarded = 0.65 * std::pow(0.9, i) * options.max_error;
            Attempt a = attempt(mesh, tree, options, guarded, fixed);
            for (const std::uint32_t p : a.to_blame) fixed[p] = true;
            if (a.deviation.max > options.max_error) continue;
            found.deviation = a.deviation;
            result = std::move(a.mesh);
            found.backed_off = false;
        }
    }
    // The link condition keeps the topology; a mesh to print is worth looking again.
    if (found.backed_off || !same_topology(mesh, result)) {
        result = mesh;
        found = {{}, true};
    } else if (!mesh.normals.empty()) {
        result.normals = point_normals(result);
    }
    if (stats) *stats = found;
    return result;
}

}  // namespace marrow
