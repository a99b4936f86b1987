// Collapses edges, and undoes collapses where the surface passes through itself
// or is too far from the original.
#include <algorithm>
#include <array>
#include <optional>
#include <utility>
#include <vector>

#include <marrow/error.h>
#include <marrow/simplify.h>

#include "base/parallel.h"
#include "base/progress.h"
#include "deviation_guard.h"
#include "edge_collapse.h"
#include "intersection_guard.h"
#include "mesh/connectivity/check_indices.h"
#include "mesh/geometry/normals.h"
#include "mesh/intersections/self_intersections.h"
#include "mesh/search/distance.h"

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

// Undoes collapses until the surface passes through itself nowhere. An undone collapse often does not help,
// as the surface came apart earlier: each time, twice as many are undone. Adds what was undone to `undone`.
// Sets `changed`, if it is not null, for the triangles that changed since the last
// call, as in the original mesh.
EdgeCollapse::Result make_valid(EdgeCollapse& collapse, std::int64_t& undone, std::vector<bool>* changed) {
    for (std::size_t count = 1;; count *= 2) {
        EdgeCollapse::Result result = collapse.result();
        if (changed != nullptr) {
            for (const std::uint32_t t : result.changed) (*changed)[result.old_triangles[t]] = true;
        }
        const std::size_t found = undo(collapse, find_intersections(result), count);
        if (found == 0) return result;
        undone += static_cast<std::int64_t>(found);
    }
}

// A reduced mesh, the number of collapses that were undone, and its distance from the
// original mesh if that was measured.
struct Reduced {
    Mesh mesh;
    std::int64_t undone = 0;
    MeshDistance deviation = {};
};

// Collapses until `triangles` are left, or until no more can be collapsed. Before a tenth is
// left, the surface hardly ever passes through itself, so that it is looked at only then. From
// there on, each collapse is looked at.
Reduced reduce_to(const Mesh& mesh, std::size_t triangles, const Progress& progress) {
    constexpr double kUnguarded = 0.1;
    EdgeCollapse collapse(mesh);
    const auto unguarded = std::max(
        triangles, static_cast<std::size_t>(kUnguarded * static_cast<double>(mesh.triangles.size())));
    collapse.reduce_to(unguarded, sub_progress(progress, 0, 0.7));
    Reduced reduced;
    EdgeCollapse::Result result = make_valid(collapse, reduced.undone, nullptr);
    if (result.mesh.triangles.size() > triangles) {
        IntersectionGuard guard(mesh, std::move(result));
        collapse.set_guard(&guard);
        collapse.reduce_to(triangles, sub_progress(progress, 0.7, 1));
        result = collapse.result();
    }
    reduced.mesh = std::move(result.mesh);
    return reduced;
}

// A reduced mesh, and what its distance from the original is measured with.
struct Candidate {
    Candidate(const EdgeCollapse& collapse, EdgeCollapse::Result r)
        : result(std::move(r)), merged_into(collapse.merged_into()), now(result.mesh) {}

    EdgeCollapse::Result result;
    Buffer<std::uint32_t> merged_into;
    SampledMesh now;
};

// The places of what is too far in the original mesh and in the reduced one.
std::vector<Place> places_of(const std::vector<Triangle>& of_original, const std::vector<Triangle>& of_now,
                             const Candidate& candidate) {
    std::vector<Place> places;
    const auto add = [&](const std::vector<Triangle>& further, const auto& old_point) {
        for (const auto& [a, b, c] : further)
            places.push_back(
                {old_point[a], old_point[b], old_point[c], old_point[a], old_point[b], old_point[c]});
    };
    add(of_original, candidate.merged_into);
    add(of_now, candidate.result.old_points);
    return places;
}

// Finds where either mesh is too far from the other one, around the triangles of the reduced mesh that have
// changed: there, and where the original was merged into their points.
std::vector<Place> find_far_around(const std::vector<bool>& changed, const SampledMesh& original,
                                   const Candidate& candidate, double max_error, const Progress& progress) {
    const EdgeCollapse::Result& result = candidate.result;
    const Buffer<std::uint32_t>& merged_into = candidate.merged_into;
    std::vector<bool> of_now, of_original, is_moved(merged_into.size());
    for (std::size_t t = 0; t < result.mesh.triangles.size(); ++t) {
        of_now.push_back(changed[result.old_triangles[t]]);
        if (!of_now.back()) continue;
        for (const std::uint32_t p : result.mesh.triangles[t]) is_moved[result.old_points[p]] = true;
    }
    for (const auto& [a, b, c] : original.mesh().triangles)
        of_original.push_back(is_moved[merged_into[a]] || is_moved[merged_into[b]] ||
                              is_moved[merged_into[c]]);
    return places_of(
        find_further(original, of_original, candidate.now.tree(), max_error, progress, 0.7, 0.75),
        find_further(candidate.now, of_now, original.tree(), max_error, progress, 0.75, 0.8), candidate);
}

// Collapses until `triangles` are left, or until the guard allows no more. Then undoes
// collapses where the surface passes through itself or is too far from the original, since the
// guard only looks at some positions.
Reduced reduce_within(const Mesh& mesh, std::size_t triangles, double max_error, bool measured,
                      const Progress& progress) {
    constexpr double kGuarded = 0.7;  // of the error: then few collapses must be undone
    const SampledMesh original(mesh);
    DeviationGuard guard(mesh, original.tree(), kGuarded * max_error);
    EdgeCollapse collapse(mesh, kGuarded * max_error, &guard);
    collapse.reduce_to(triangles, sub_progress(progress, 0, 0.7));
    Reduced reduced;
    std::vector<bool> changed(mesh.triangles.size(), true);
    bool all_changed = true;
    for (std::size_t count = 1;; count *= 2) {
        Candidate candidate(collapse, make_valid(collapse, reduced.undone, &changed));
        std::vector<Place> places = find_far_around(changed, original, candidate, max_error, progress);
        std::size_t found = undo(collapse, places, count);
        // The samples of the reduced mesh have moved with its area, so in the
        // end all of it is looked at again.
        if (found == 0 && (measured || !all_changed)) {
            changed.assign(changed.size(), true);
            if (measured) {
                const Distances there =
                    distances(original, candidate.now.tree(), max_error, progress, 0.8, 0.9);
                const Distances back = distances(candidate.now, original.tree(), max_error, progress, 0.9, 1);
                reduced.deviation = symmetric(there, back);
                places = places_of(there.further, back.further, candidate);
            } else {
                places = find_far_around(changed, original, candidate, max_error, progress);
            }
            found = undo(collapse, places, count);
        }
        if (found == 0) {
            reduced.mesh = std::move(candidate.result.mesh);
            return reduced;
        }
        reduced.undone += static_cast<std::int64_t>(found);
        changed.assign(changed.size(), false);
        all_changed = false;
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
