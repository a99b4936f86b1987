// Collapses edges, and undoes collapses where the surface passes through itself
// or is too far from the original.
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
#include "deviation_guard.h"
#include "edge_collapse.h"
#include "intersection_guard.h"
#include "mesh/connectivity/check_mesh.h"
#include "mesh/geometry/bounds.h"
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

// Finds where the surface passes through itself since the last call. Reports `fraction`, so that the search
// can be cancelled.
std::vector<Place> find_intersections(const EdgeCollapse::Result& result, const Progress& progress,
                                      double fraction) {
    report_progress(progress, fraction);
    // Searching from single triangles takes longer for each of them.
    const bool few = result.changed.size() < result.mesh.triangles.size() / 4;
    std::vector<Place> places;
    for (const auto& [s, t] :
         few ? SelfIntersections(result.mesh).find_changed(result.changed)
             : find_self_intersections(result.mesh, OneRings(result.mesh), progress, fraction, fraction)) {
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
EdgeCollapse::Result make_valid(EdgeCollapse& collapse, std::int64_t& undone, std::vector<bool>* changed,
                                const Progress& progress, double fraction) {
    for (std::size_t count = 1;; count *= 2) {
        EdgeCollapse::Result result = collapse.result();
        if (changed != nullptr) {
            for (const std::uint32_t t : result.changed) (*changed)[result.old_triangles[t]] = true;
        }
        const std::size_t found = undo(collapse, find_intersections(result, progress, fraction), count);
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
    EdgeCollapse::Result result = make_valid(collapse, reduced.undone, nullptr, progress, 0.7);
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
    explicit Candidate(EdgeCollapse::Result r) : result(std::move(r)), now(result.mesh) {}

    EdgeCollapse::Result result;
    SampledMesh now;
};

// The places of what is too far in the original mesh and in the reduced one.
std::vector<Place> places_of(const std::vector<Triangle>& of_original, const std::vector<Triangle>& of_now,
                             const EdgeCollapse& collapse, const Candidate& candidate) {
    std::vector<Place> places;
    const auto add = [&](const std::vector<Triangle>& further, const auto& old_point) {
        for (const auto& [a, b, c] : further)
            places.push_back(
                {old_point[a], old_point[b], old_point[c], old_point[a], old_point[b], old_point[c]});
    };
    if (!of_original.empty()) add(of_original, collapse.merged_into());
    add(of_now, candidate.result.old_points);
    return places;
}

// Marks the triangles of the original mesh that are within `distance` of the reduced triangles that changed.
void mark_near_changed(const EdgeCollapse::Result& reduced, const std::vector<bool>& changed,
                       const TriangleTree& original, double distance, std::vector<bool>& marked) {
    const auto margin = static_cast<float>(1.0001 * distance);
    for (std::size_t t = 0; t < reduced.mesh.triangles.size(); ++t) {
        if (!changed[reduced.old_triangles[t]]) continue;
        Bounds bounds = bounds_of(reduced.mesh, reduced.mesh.triangles[t]);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            bounds.lower[axis] = std::nextafter(bounds.lower[axis] - margin, -Bounds::kInfinity);
            bounds.upper[axis] = std::nextafter(bounds.upper[axis] + margin, Bounds::kInfinity);
        }
        original.for_each_in(bounds, [&](std::uint32_t near) { marked[near] = true; });
    }
}

// Collapses until `triangles` are left, or until the guard allows no more. Then undoes
// collapses where the surface passes through itself or is too far from the original, since the
// guard only looks at some positions.
Reduced reduce_within(const Mesh& mesh, std::size_t triangles, double max_error, const Progress& progress) {
    constexpr double kGuarded = 0.7;  // of the error: then few collapses must be undone
    const SampledMesh original(mesh);
    DeviationGuard guard(mesh, original.tree(), kGuarded * max_error);
    EdgeCollapse collapse(mesh, kGuarded * max_error, &guard);
    collapse.reduce_to(triangles, sub_progress(progress, 0, 0.7));
    Reduced reduced;
    // By triangles of the original: which of the reduced ones have changed since they were
    // measured, and which of the original ones are near these.
    std::vector<bool> changed(mesh.triangles.size(), true), near_changed = changed;
    Distances there, back;
    std::optional<Candidate> candidate;
    for (std::size_t count = 1;; count *= 2) {
        EdgeCollapse::Result result = make_valid(collapse, reduced.undone, &changed, progress, 0.7);
        if (candidate) {
            near_changed.assign(near_changed.size(), false);
            for (const EdgeCollapse::Result* r : {&candidate->result, &result})
                mark_near_changed(*r, changed, original.tree(), max_error, near_changed);
        }
        candidate.emplace(std::move(result));
        const std::vector<Triangle> further_there =
            there.measure_again(original, {.names = {}, .stale = near_changed}, candidate->now.tree(),
                                max_error, progress, 0.8, 0.9);
        const std::vector<Triangle> further_back =
            back.measure_again(candidate->now, {.names = candidate->result.old_triangles, .stale = changed},
                               original.tree(), max_error, progress, 0.9, 1);
        const std::size_t found =
            undo(collapse, places_of(further_there, further_back, collapse, *candidate), count);
        if (found == 0) {
            reduced.mesh = std::move(candidate->result.mesh);
            reduced.deviation = symmetric(there, back);
            return reduced;
        }
        reduced.undone += static_cast<std::int64_t>(found);
        changed.assign(changed.size(), false);
    }
}

// Multiplies all coordinates by a power of two, which changes nothing else. Points without triangles may be
// so far away that they must stop before infinity.
void scale(Mesh& mesh, int exponent) {
    constexpr float kMost = std::numeric_limits<float>::max();
    for (Vec3f& p : mesh.points) {
        for (float& x : p) x = std::clamp(std::ldexp(x, exponent), -kMost, kMost);
    }
}

Mesh simplified(const Mesh& mesh, const SimplifyOptions& options, SimplifyStats* stats) {
    const auto triangles = static_cast<std::size_t>(options.triangles.value_or(0));
    // Stages go back, but the progress must not decrease.
    double furthest = 0;
    const Progress progress = [&](double fraction) {
        furthest = std::max(furthest, fraction);
        return !options.progress || options.progress(furthest);
    };
    Reduced reduced = options.max_error ? reduce_within(mesh, triangles, *options.max_error, progress)
                                        : reduce_to(mesh, triangles, progress);
    if (stats) {
        if (!options.max_error)
            reduced.deviation =
                mesh_distance(mesh, reduced.mesh, {.threads = options.threads, .progress = progress});
        *stats = {reduced.deviation, reduced.undone};
    }
    report_progress(progress, 1);
    if (!mesh.normals.empty()) set_normals(reduced.mesh);
    return std::move(reduced.mesh);
}

// The same for meshes of any width. Errors are areas times squared distances, which must neither overflow nor
// vanish in a float.
Mesh simplified_at_any_scale(const Mesh& mesh, const SimplifyOptions& options, SimplifyStats* stats) {
    constexpr float kSmallestWidth = 1e-3f, kLargestWidth = 1e9f;
    const float width = bounds_of_triangles(mesh).width();
    if (width == 0 || (width >= kSmallestWidth && width <= kLargestWidth))
        return simplified(mesh, options, stats);
    const int exponent = std::ilogb(std::min(width, std::numeric_limits<float>::max()));
    Mesh scaled = mesh;
    scale(scaled, -exponent);
    SimplifyOptions scaled_options = options;
    if (options.max_error) scaled_options.max_error = std::ldexp(*options.max_error, -exponent);
    Mesh result = simplified(scaled, scaled_options, stats);
    scale(result, exponent);
    if (stats) {
        for (double* distance : {&stats->deviation.mean, &stats->deviation.max})
            *distance = std::ldexp(*distance, exponent);
    }
    return result;
}

}  // namespace

Mesh simplify(const Mesh& mesh, const SimplifyOptions& options, SimplifyStats* stats) {
    if (options.triangles && *options.triangles < 0)
        throw InputError("simplify: the number of triangles must not be negative");
    if (options.max_error && !(*options.max_error > 0))
        throw InputError("simplify: the largest error must be above 0 mm");
    check_arrays(mesh);
    check_coordinates(mesh.points);
    if (mesh.triangles.size() >= std::size_t{1} << 30)
        throw LimitError("simplify: the mesh has 2^30 triangles or more");
    if (stats) *stats = {};
    if (mesh.triangles.size() <= static_cast<std::size_t>(options.triangles.value_or(0))) return mesh;
    Mesh result;
    with_threads(options.threads, [&] { result = simplified_at_any_scale(mesh, options, stats); });
    return result;
}

}  // namespace marrow
