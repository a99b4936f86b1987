// Collapses edges, undoes collapses where the surface passes through itself, measures the result, and tries
// again more carefully if the error is too large.
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
#include "base/progress.h"
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

// Undoes collapses until the surface passes through itself nowhere. An undone collapse often does not help, as
// the surface came apart earlier: each time, twice as many are undone. Adds what was undone to `undone`.
EdgeCollapse::Result make_valid(EdgeCollapse& collapse, std::int64_t& undone) {
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
        if (found == 0) return result;
        undone += static_cast<std::int64_t>(found);
    }
}

// Collapses until `triangles` are left, or until no more can be collapsed and leave the surface valid. It goes
// in stages, so that few collapses are built on one that must be undone. Stages are smaller once thin walls make
// the surface pass through itself in many places. There, a stage may end with more triangles than it began with,
// and later ones with fewer again, as they leave the points of undone collapses alone.
EdgeCollapse::Result reduce_to_valid(EdgeCollapse& collapse, std::size_t triangles, const Progress& progress,
                                     std::int64_t& undone) {
    constexpr double kLarge = 0.5, kSmall = 0.8, kMany = 0.01, kLeastGain = 0.01;
    constexpr int kPatience = 4;  // so many stages in a row may bring nothing
    const auto all = static_cast<double>(collapse.triangles()), last = static_cast<double>(triangles);
    const auto done = [&](double left) { return (all - left) / (all - last); };
    EdgeCollapse::Result best;
    double least = std::numeric_limits<double>::infinity();
    double stage = kLarge;
    for (int fruitless = 0;;) {
        const auto before = static_cast<double>(collapse.triangles());
        const double wanted = std::max(last, std::floor(stage * before));
        collapse.reduce_to(static_cast<std::size_t>(wanted),
                           sub_progress(progress, done(before), done(wanted)));
        std::int64_t undone_here = 0;
        EdgeCollapse::Result result = make_valid(collapse, undone_here);
        undone += undone_here;
        const auto left = static_cast<double>(collapse.triangles());
        fruitless = left < (1 - kLeastGain) * least ? 0 : fruitless + 1;
        if (left < least) {
            least = left;
            best = std::move(result);
        }
        const bool is_exhausted = undone_here == 0 && left > wanted;
        if (left <= last || is_exhausted || fruitless == kPatience) return best;
        if (static_cast<double>(undone_here) > kMany * (before - left)) stage = kSmall;
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
    // The guard does not know of undone collapses, so with it there are no further stages.
    if (guard) collapse.reduce_to(limits.triangles, progress);
    auto [reduced, old_points, old_triangles] =
        guard ? make_valid(collapse, result.undone)
              : reduce_to_valid(collapse, limits.triangles, progress, result.undone);
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
    for (int i = 0; i < kMaxAttempts; ++i) {
        const double guarded = 0.65 * std::pow(0.9, i) * limits.max_error;
        Attempt a = attempt(mesh, tree, limits, progress, guarded, fixed);
        if (!(a.deviation.max > limits.max_error)) return a;
        for (const std::uint32_t p : a.to_fix) fixed[p] = true;
    }
    return {};
}

Attempt reduce_unmeasured(const Mesh& mesh, const Limits& limits, const Progress& progress) {
    EdgeCollapse collapse(mesh, limits.max_error);
    Attempt result;
    result.mesh = reduce_to_valid(collapse, limits.triangles, progress, result.undone).mesh;
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
    // Attempts and stages go back, but the progress must not decrease.
    double furthest = 0;
    const Progress progress = [&](double fraction) {
        furthest = std::max(furthest, fraction);
        return !options.progress || options.progress(furthest);
    };
    std::optional<Attempt> reduced;
    if (std::isfinite(limits.max_error) || stats)
        reduced = reduce_within_error(mesh, limits, progress);
    else
        reduced = reduce_unmeasured(mesh, limits, progress);
    if (!reduced || !has_same_topology(mesh, reduced->mesh)) {
        if (stats) stats->backed_off = true;
        return mesh;
    }
    if (!mesh.normals.empty()) set_normals(reduced->mesh);
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
