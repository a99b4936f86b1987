// Collapses edges, undoes collapses where the surface passes through itself, measures the result, and tries again more carefully if the error is too large.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <marrow/error.h>
#include <marrow/simplify.h>

#include "base/parallel.h"
#include "check_indices.h"
#include "distance.h"
#include "edge_collapse.h"
#include "normals.h"
#include "self_intersections.h"

namespace marrow {

using namespace internal;

namespace {

// The stopping conditions of SimplifyOptions, with values for conditions that are not set.
struct Limits {
    std::size_t triangles;
    double max_error;

    explicit Limits(const SimplifyOptions& options)
        : triangles(static_cast<std::size_t>(options.triangles.value_or(0))),
          max_error(options.max_error.value_or(std::numeric_limits<double>::infinity())) {}
};

// Collapses until `triangles` are left, undoes collapses until the surface passes through itself nowhere, and
// makes up for them elsewhere if `again` is set. An undone collapse often does not help, as the surface came
// apart earlier: each time, twice as many are undone. Adds what was undone to `undone`.
EdgeCollapse::Result reduce_to_valid(EdgeCollapse& collapse, std::size_t triangles, bool again,
                                     const Progress& progress, std::int64_t& undone) {
    constexpr int kMostTimes = 4;
    for (int times = 1;; ++times) {
        const std::size_t before = collapse.triangles();
        collapse.reduce_to(triangles, progress);
        const bool is_last = !again || times == kMostTimes || collapse.triangles() == before;
        for (std::size_t count = 1;; count *= 2) {
            EdgeCollapse::Result result = collapse.result();
            std::size_t found = 0;
            for (const auto& [s, t] : SelfIntersections(result.mesh).find_all()) {
                std::array<std::uint32_t, 6> corners;
                for (std::size_t c = 0; c < 3; ++c) {
                    corners[c] = result.old_points[result.mesh.triangles[s][c]];
                    corners[3 + c] = result.old_points[result.mesh.triangles[t][c]];
                }
                found += collapse.undo(corners, count);
            }
            undone += static_cast<std::int64_t>(found);
            if (found > 0) continue;
            if (is_last || collapse.triangles() <= triangles) return result;
            break;
        }
    }
}

// A reduced mesh, its distance from the original mesh, and the original points near positions that are too
// far.
struct Attempt {
    Mesh mesh;
    MeshDistance deviation;
    std::vector<std::uint32_t> to_fix;
    std::int64_t undone = 0;
};

// Finds the original points to fix: those that are too far from the reduced mesh, and those near its
// positions that are too far from the original.
std::vector<std::uint32_t> points_to_fix(const Mesh& mesh, const TriangleTree& tree, const Mesh& reduced,
                                         const std::vector<std::uint32_t>& old_triangles,
                                         const DeviationGuard& guard, const Distances& there,
                                         const Distances& back, double max_error) {
    std::vector<std::uint32_t> to_fix;
    const auto fix = [&](std::uint32_t p) { to_fix.push_back(p); };
    const auto fix_corners = [&](std::uint32_t t) {
        for (const std::uint32_t p : mesh.triangles[t]) fix(p);
    };
    for (std::uint32_t p = 0; p < mesh.points.size(); ++p) {
        if (there.points[p] > max_error) fix(p);
    }
    for (const Distances::SurfaceSample& s : there.samples) {
        if (s.distance > max_error) fix_corners(s.triangle);
    }
    for (const Distances::SurfaceSample& s : back.samples) {
        if (s.distance <= max_error) continue;
        fix_corners(tree.nearest(s.position).triangle);
        guard.for_each_point_of(old_triangles[s.triangle], fix);
    }
    for (const Vec3f& p : reduced.points) {
        const auto nearest = tree.nearest(to_double(p), max_error);
        if (nearest.distance > max_error) fix_corners(nearest.triangle);
    }
    return to_fix;
}

// Reduces with the guard at the distance `guarded`, and measures the result.
Attempt attempt(const Mesh& mesh, const TriangleTree& tree, const Limits& limits, const Progress& progress,
                double guarded, const std::vector<bool>& fixed) {
    std::optional<DeviationGuard> guard;
    if (std::isfinite(limits.max_error)) guard.emplace(mesh, tree, guarded);
    EdgeCollapse collapse(mesh, guarded, guard ? &*guard : nullptr);
    for (std::uint32_t p = 0; p < fixed.size(); ++p) {
        if (fixed[p]) collapse.fix(p);
    }
    Attempt result;
    auto [reduced, old_points, old_triangles] =
        reduce_to_valid(collapse, limits.triangles, !guard, progress, result.undone);
    result.mesh = std::move(reduced);
    const TriangleTree new_tree(result.mesh);
    const DistanceSearch search{.enough = limits.max_error};
    const Distances there = distances(mesh, tree, new_tree, search);
    const Distances back = distances(result.mesh, new_tree, tree, search);
    result.deviation = symmetric(there, back);
    if (result.deviation.max > limits.max_error)
        result.to_fix =
            points_to_fix(mesh, tree, result.mesh, old_triangles, *guard, there, back, limits.max_error);
    return result;
}

// Attempts are increasingly careful. The guard samples each triangle only at a few positions, so the
// measurement may find a larger error in between. The next attempt fixes the points near such positions.
// Returns nothing if every attempt exceeds the error.
std::optional<Attempt> reduce_within_error(const Mesh& mesh, const Limits& limits, const Progress& progress) {
    constexpr int kMaxAttempts = 8;
    const TriangleTree tree(mesh);
    std::vector<bool> fixed(mesh.points.size(), false);
    // Each attempt starts from the mesh again, but the progress must not decrease.
    double furthest = 0;
    const Progress never_decreasing = [&](double fraction) {
        furthest = std::max(furthest, fraction);
        return !progress || progress(furthest);
    };
    for (int i = 0; i < kMaxAttempts; ++i) {
        const double guarded = 0.65 * std::pow(0.9, i) * limits.max_error;
        Attempt a = attempt(mesh, tree, limits, never_decreasing, guarded, fixed);
        if (!(a.deviation.max > limits.max_error)) return a;
        for (const std::uint32_t p : a.to_fix) fixed[p] = true;
    }
    return {};
}

Attempt reduce_unmeasured(const Mesh& mesh, const Limits& limits, const Progress& progress) {
    EdgeCollapse collapse(mesh, limits.max_error);
    Attempt result;
    result.mesh = reduce_to_valid(collapse, limits.triangles, true, progress, result.undone).mesh;
    return result;
}

bool has_same_topology(const Mesh& a, const Mesh& b) {
    const MeshMeasures m = measure(a), n = measure(b);
    const auto unused_points = [](const Mesh& mesh) {
        std::vector<bool> used(mesh.points.size(), false);
        for (const Triangle& t : mesh.triangles) used[t[0]] = used[t[1]] = used[t[2]] = true;
        return std::count(used.begin(), used.end(), false);
    };
    return m.components == n.components && m.boundary_edges == n.boundary_edges &&
           m.nonmanifold_edges == n.nonmanifold_edges &&
           m.euler_characteristic - unused_points(a) == n.euler_characteristic - unused_points(b);
}

// The link condition keeps the topology. The final comparison guards against mistakes in it.
Mesh simplified(const Mesh& mesh, const SimplifyOptions& options, SimplifyStats* stats) {
    const Limits limits(options);
    if (mesh.triangles.size() <= limits.triangles) return mesh;
    std::optional<Attempt> reduced;
    if (std::isfinite(limits.max_error) || stats)
        reduced = reduce_within_error(mesh, limits, options.progress);
    else
        reduced = reduce_unmeasured(mesh, limits, options.progress);
    if (!reduced || !has_same_topology(mesh, reduced->mesh)) {
        if (stats) stats->backed_off = true;
        return mesh;
    }
    if (!mesh.normals.empty()) reduced->mesh.normals = point_normals(reduced->mesh);
    if (stats) {
        stats->deviation = reduced->deviation;
        stats->undone_collapses = reduced->undone;
    }
    return std::move(reduced->mesh);
}

}  // namespace

Mesh simplify(const Mesh& mesh, const SimplifyOptions& options, SimplifyStats* stats) {
    if (options.triangles && *options.triangles < 0)
        throw InputError("simplify: the number of triangles must not be negative");
    if (options.max_error && !(*options.max_error > 0))
        throw InputError("simplify: the largest error must be above 0 mm");
    check_indices(mesh);
    if (mesh.triangles.size() >= std::size_t{1} << 30)
        throw LimitError("simplify: the mesh has 2^30 triangles or more");
    if (stats) *stats = {};
    Mesh result;
    with_threads(options.threads, [&] { result = simplified(mesh, options, stats); });
    return result;
}

}  // namespace marrow
