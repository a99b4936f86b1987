// Collapses edges, and undoes collapses where the surface passes through itself or is too far from the original.
#include <algorithm>
#include <array>
#include <optional>
#include <utility>
#include <vector>

#include <marrow/error.h>
#include <marrow/simplify.h>

#include "base/parallel.h"
#include "base/progress.h"
#include "check_indices.h"
#include "deviation_guard.h"
#include "distance.h"
#include "edge_collapse.h"
#include "intersection_guard.h"
#include "normals.h"
#include "self_intersections.h"

namespace marrow {

using namespace internal;

namespace {

// Up to six points of the original mesh around a place where the reduced surface is wrong.
using Place = std::array<std::uint32_t, 6>;

// Undoes up to `count` collapses at each place. Returns how many it undid.
std::size_t undo(EdgeCollapse& collapse, const std::vector<Place>& places, std::size_t count) {
    std::size_t undone = 0;
    for (const Place& place : places) undone += collapse.undo(place, count);
    return undone;
}

// Finds where the surface passes through itself since the last call.
std::vector<Place> find_intersections(const EdgeCollapse::Result& result) {
    // Searching from single triangles takes longer for each of them.
    const bool few = result.changed.size() < result.mesh.triangles.size() / 4;
    std::vector<Place> places;
    for (const auto& [s, t] : few ? SelfIntersections(result.mesh).find_changed(result.changed)
                                  : find_self_intersections(result.mesh, OneRings(result.mesh))) {
        Place& place = places.emplace_back();
        for (std::size_t c = 0; c < 3; ++c) {
            place[c] = result.old_points[result.mesh.triangles[s][c]];
            place[3 + c] = result.old_points[result.mesh.triangles[t][c]];
        }
    }
    return places;
}

// Undoes collapses until the surface passes through itself nowhere. An undone collapse often does not help, as
// the surface came apart earlier: each time, twice as many are undone. Adds what was undone to `undone`.
EdgeCollapse::Result make_valid(EdgeCollapse& collapse, std::int64_t& undone) {
    for (std::size_t count = 1;; count *= 2) {
        EdgeCollapse::Result result = collapse.result();
        const std::size_t found = undo(collapse, find_intersections(result), count);
        if (found == 0) return result;
        undone += static_cast<std::int64_t>(found);
    }
}

// A reduced mesh, the number of collapses that were undone, and its distance from the original mesh if that was
// measured.
struct Reduced {
    Mesh mesh;
    std::int64_t undone = 0;
    MeshDistance deviation = {};
};

// Collapses until `triangles` are left, or until no more can be collapsed. Before a tenth is left, the surface hardly
// ever passes through itself, so that it is looked at only then. From there on, each collapse is looked at.
Reduced reduce_to(const Mesh& mesh, std::size_t triangles, const Progress& progress) {
    constexpr double kUnguarded = 0.1;
    EdgeCollapse collapse(mesh);
    const auto unguarded = std::max(
        triangles, static_cast<std::size_t>(kUnguarded * static_cast<double>(mesh.triangles.size())));
    collapse.reduce_to(unguarded, sub_progress(progress, 0, 0.7));
    Reduced reduced;
    EdgeCollapse::Result result = make_valid(collapse, reduced.undone);
    if (result.mesh.triangles.size() > triangles) {
        IntersectionGuard guard(mesh, std::move(result));
        collapse.set_guard(&guard);
        collapse.reduce_to(triangles, sub_progress(progress, 0.7, 1));
        result = collapse.result();
    }
    reduced.mesh = std::move(result.mesh);
    return reduced;
}

// Finds where a mesh is further than `max_error` from the other one. `now` has the point of the reduced mesh for each
// of its points, as an index in the original mesh.
template <class Indices>
std::vector<Place> find_far(const SampledMesh& from, const TriangleTree& to, const Indices& now,
                            double max_error, const Progress& progress, double begin, double end) {
    std::vector<Place> places;
    for (const auto& [a, b, c] : find_further(from, to, max_error, progress, begin, end))
        places.push_back({now[a], now[b], now[c], now[a], now[b], now[c]});
    return places;
}

// Collapses until `triangles` are left, or until the guard allows no more. Then undoes collapses where the surface
// passes through itself or is too far from the original, since the guard only looks at some positions.
Reduced reduce_within(const Mesh& mesh, std::size_t triangles, double max_error, bool measured,
                      const Progress& progress) {
    constexpr double kGuarded = 0.7;  // of the error: then few collapses must be undone
    const SampledMesh original(mesh);
    DeviationGuard guard(mesh, original.tree(), kGuarded * max_error);
    EdgeCollapse collapse(mesh, kGuarded * max_error, &guard);
    collapse.reduce_to(triangles, sub_progress(progress, 0, 0.7));
    Reduced reduced;
    for (std::size_t count = 1;; count *= 2) {
        EdgeCollapse::Result result = make_valid(collapse, reduced.undone);
        const SampledMesh now(result.mesh);
        // Most of what is too far shows from the original, so the other direction often can wait.
        std::vector<Place> places =
            find_far(original, now.tree(), collapse.merged_into(), max_error, progress, 0.7, 0.75);
        if (places.empty())
            places = find_far(now, original.tree(), result.old_points, max_error, progress, 0.75, 0.8);
        const std::size_t found = undo(collapse, places, count);
        reduced.undone += static_cast<std::int64_t>(found);
        if (found > 0) continue;
        if (measured)
            reduced.deviation = symmetric(distances(original, now.tree(), progress, 0.8, 0.9),
                                          distances(now, original.tree(), progress, 0.9, 1));
        reduced.mesh = std::move(result.mesh);
        return reduced;
    }
}

Mesh simplified(const Mesh& mesh, const SimplifyOptions& options, SimplifyStats* stats) {
    const auto triangles = static_cast<std::size_t>(options.triangles.value_or(0));
    if (mesh.triangles.size() <= triangles) return mesh;
    // Stages go back, but the progress must not decrease.
    double furthest = 0;
    const Progress progress = [&](double fraction) {
        furthest = std::max(furthest, fraction);
        return !options.progress || options.progress(furthest);
    };
    Reduced reduced = options.max_error
                          ? reduce_within(mesh, triangles, *options.max_error, stats != nullptr, progress)
                          : reduce_to(mesh, triangles, progress);
    if (stats) {
        if (!options.max_error)
            reduced.deviation =
                mesh_distance(mesh, reduced.mesh, {.threads = options.threads, .progress = progress});
        *stats = {reduced.deviation, reduced.undone};
    }
    if (!mesh.normals.empty()) set_normals(reduced.mesh);
    return std::move(reduced.mesh);
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
