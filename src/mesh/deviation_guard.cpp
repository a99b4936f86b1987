// Assigns the original points to triangles, and measures distances around each change.
#include "deviation_guard.h"

#include <hwy/cache_control.h>

#include <algorithm>
#include <limits>

#include "triangle_distance.h"

namespace marrow::internal {

DeviationGuard::DeviationGuard(const Mesh& mesh, const TriangleTree& tree, double max_distance)
    : mesh_(mesh),
      tree_(tree),
      max_distance_(max_distance),
      first_point_(mesh.triangles.size(), kNone),
      next_point_(mesh.points.size(), kNone),
      fans_(mesh) {
    std::vector<bool> assigned(mesh.points.size(), false);
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
        for (const std::uint32_t p : mesh.triangles[t]) {
            if (assigned[p]) continue;
            assigned[p] = true;
            next_point_[p] = first_point_[t];
            first_point_[t] = p;
        }
    }
}

bool DeviationGuard::accept(std::span<const std::uint32_t> removed, std::span<const PatchTriangle> patch) {
    Scratch& scratch = scratch_.local();
    std::vector<Assignment>& assignments = scratch.assignments;
    assignments.clear();
    const auto list = [&](std::uint32_t triangle, std::uint32_t guess) {
        for (std::uint32_t p = first_point_[triangle]; p != kNone; p = next_point_[p])
            assignments.push_back({to_double(mesh_.points[p]), p, kNone, guess});
    };
    for (const PatchTriangle& t : patch) {
        const std::uint32_t p = first_point_[t.index];
        if (p == kNone) continue;
        hwy::Prefetch(&mesh_.points[p]);
        hwy::Prefetch(&next_point_[p]);
    }
    for (const std::uint32_t t : removed) list(t, 0);
    for (std::uint32_t i = 0; i < patch.size(); ++i) list(patch[i].index, i);
    if (!points_stay_near(assignments, patch) || !patch_is_near(scratch.positions, assignments, patch))
        return false;
    for (const std::uint32_t t : removed) first_point_[t] = kNone;
    for (const PatchTriangle& t : patch) first_point_[t.index] = kNone;
    for (const Assignment& a : assignments) {
        next_point_[a.point] = first_point_[a.triangle];
        first_point_[a.triangle] = a.point;
    }
    return true;
}

// Assigns each point to a triangle of the patch that it is above or below and near, or else to the nearest one. False
// if one is too far from all of them.
bool DeviationGuard::points_stay_near(std::span<Assignment> assignments,
                                      std::span<const PatchTriangle> patch) const {
    const double most = max_distance_ * max_distance_;
    for (Assignment& a : assignments) {
        const auto is_across_from = [&](const PatchTriangle& t) {
            const auto& [p, q, r] = t.corners;
            return is_across(a.position, p, q, r, most);
        };
        if (!patch.empty() && is_across_from(patch[a.guess])) {
            a.triangle = patch[a.guess].index;
            continue;
        }
        const auto found = std::find_if(patch.begin(), patch.end(), is_across_from);
        if (found != patch.end()) {
            a.triangle = found->index;
            continue;
        }
        double nearest = most;
        for (const PatchTriangle& t : patch) {
            const auto& [p, q, r] = t.corners;
            const double d = squared_distance_to_triangle(a.position, p, q, r);
            if (d <= nearest) nearest = d, a.triangle = t.index;
        }
        if (a.triangle == kNone) return false;
    }
    return true;
}

// Looks at the common corner and at the middle of each new edge. Within a triangle the patch is flat, so it is
// furthest from the original at the original points, or where it bends itself.
//
// Such a position mostly is above or below one of the triangles at the nearest of the patch's points. These triangles
// may be anywhere in memory, so they are fetched in stages, for all positions at once.
bool DeviationGuard::patch_is_near(std::vector<Position>& positions, std::span<const Assignment> assignments,
                                   std::span<const PatchTriangle> patch) const {
    if (patch.empty()) return false;
    positions.clear();
    positions.push_back({patch.front().corners[0]});
    for (const PatchTriangle& t : patch) positions.push_back({0.5 * (t.corners[0] + t.corners[1])});
    for (Position& position : positions) {
        double least = std::numeric_limits<double>::infinity();
        for (const Assignment& a : assignments) {
            const Vec3d difference = a.position - position.at;
            if (const double d = dot(difference, difference); d < least)
                least = d, position.nearest = a.point;
        }
    }
    for (const Position& position : positions) {
        if (position.nearest == kNone) continue;
        hwy::Prefetch(fans_.begin(position.nearest));
        hwy::Prefetch(fans_.end(position.nearest) - 1);
    }
    for (const Position& position : positions) {
        if (position.nearest == kNone) continue;
        for (const Triangle* t = fans_.begin(position.nearest); t != fans_.end(position.nearest); ++t)
            hwy::Prefetch(&mesh_.points[(*t)[1]]);
    }
    return std::all_of(positions.begin(), positions.end(),
                       [&](const Position& position) { return is_near(position); });
}

// Whether a position is near the original surface.
bool DeviationGuard::is_near(const Position& position) const {
    const double most = max_distance_ * max_distance_;
    if (position.nearest != kNone) {
        for (const Triangle* t = fans_.begin(position.nearest); t != fans_.end(position.nearest); ++t) {
            const auto& [p, q, r] = corners_of(mesh_, *t);
            if (is_across(position.at, p, q, r, most)) return true;
        }
    }
    return tree_.is_within(position.at, max_distance_);
}

}  // namespace marrow::internal
