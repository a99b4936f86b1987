// Assigns the original points to triangles, and measures distances around each change.
#include "deviation_guard.h"

#include <hwy/cache_control.h>

#include <algorithm>
#include <limits>

#include "mesh/connectivity/one_rings.h"
#include "mesh/search/triangle_distance.h"

namespace marrow::internal {

DeviationGuard::DeviationGuard(const Mesh& mesh, const TriangleTree& tree, double max_distance)
    : mesh_(mesh), tree_(tree), max_distance_(max_distance), first_point_(mesh.triangles.size(), kNone) {
    // A triangle of the original that lies across an edge of the patch is on average half an edge beyond it:
    // there, the planes may be as far apart as the error.
    double squared_edges = 0;
    for (const Triangle& t : mesh.triangles) {
        const Vec3d edge = to_double(mesh.points[t[1]]) - to_double(mesh.points[t[0]]);
        squared_edges += dot(edge, edge);
    }
    if (squared_edges > 0)
        most_bend_ =
            4 * max_distance * max_distance * static_cast<double>(mesh.triangles.size()) / squared_edges;
    const OneRings rings(mesh);
    listed_.reserve(mesh.points.size());
    neighbours_.reserve(3 * mesh.triangles.size());
    for (std::uint32_t p = 0; p < mesh.points.size(); ++p) {
        const auto first = static_cast<std::uint32_t>(neighbours_.size());
        if (rings.is_fan(p)) neighbours_.insert(neighbours_.end(), rings.of(p).begin(), rings.of(p).end());
        listed_.push_back(
            {mesh.points[p], kNone, first, static_cast<std::uint32_t>(neighbours_.size()) - first});
    }
    std::vector<bool> assigned(mesh.points.size(), false);
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
        for (const std::uint32_t p : mesh.triangles[t]) {
            if (assigned[p]) continue;
            assigned[p] = true;
            listed_[p].next = first_point_[t];
            first_point_[t] = p;
        }
    }
}

bool DeviationGuard::accept(std::span<const std::uint32_t> removed, std::span<const PatchTriangle> patch) {
    Scratch& scratch = scratch_.local();
    std::vector<Assignment>& assignments = scratch.assignments;
    assignments.clear();
    // The lists are scattered over the memory, so they are fetched while the planes are computed.
    for (const std::uint32_t t : removed) hwy::Prefetch(&first_point_[t]);
    for (const PatchTriangle& t : patch) hwy::Prefetch(&first_point_[t.index]);
    set_planes(scratch.planes, patch);
    for (const PatchTriangle& t : patch) {
        const std::uint32_t p = first_point_[t.index];
        hwy::Prefetch(&listed_[p == kNone ? 0 : p]);
    }
    const auto list = [&](std::uint32_t triangle, std::uint32_t guess) {
        for (std::uint32_t p = first_point_[triangle]; p != kNone; p = listed_[p].next)
            assignments.push_back({to_double(listed_[p].position), p, kNone, guess});
    };
    for (const std::uint32_t t : removed) list(t, 0);
    for (std::uint32_t i = 0; i < patch.size(); ++i) list(patch[i].index, i);
    if (patch.empty()) return false;
    list_positions(scratch.positions, assignments, scratch.planes, patch);
    if (!points_stay_near(assignments, scratch.planes, patch) || !patch_is_near(scratch.positions))
        return false;
    for (const std::uint32_t t : removed) first_point_[t] = kNone;
    for (const PatchTriangle& t : patch) first_point_[t.index] = kNone;
    for (const Assignment& a : assignments) {
        listed_[a.point].next = first_point_[a.triangle];
        first_point_[a.triangle] = a.point;
    }
    return true;
}

void DeviationGuard::set_planes(std::vector<Plane>& planes, std::span<const PatchTriangle> patch) {
    planes.clear();
    for (const PatchTriangle& t : patch) {
        const Vec3d u = t.corners[1] - t.corners[0], v = t.corners[2] - t.corners[0], n = cross(u, v);
        planes.push_back({n, cross(v, n), cross(n, u), dot(n, n)});
    }
}

// Assigns each point to a triangle of the patch that it is above or below and near, or else to the nearest
// one. False if one is too far from all of them.
bool DeviationGuard::points_stay_near(std::span<Assignment> assignments, std::span<const Plane> planes,
                                      std::span<const PatchTriangle> patch) const {
    const double most = max_distance_ * max_distance_;
    for (Assignment& a : assignments) {
        const Vec3d from_corner = a.position - patch.front().corners[0];
        const auto is_across_from = [&](const Plane& plane) {
            const double s = dot(from_corner, plane.to_v), t = dot(from_corner, plane.to_u),
                         height = dot(from_corner, plane.n);
            return plane.nn > 0 && s >= 0 && t >= 0 && s + t <= plane.nn &&
                   height * height <= most * plane.nn;
        };
        if (is_across_from(planes[a.guess])) {
            a.triangle = patch[a.guess].index;
            continue;
        }
        const auto found = std::find_if(planes.begin(), planes.end(), is_across_from);
        if (found != planes.end()) {
            a.triangle = patch[static_cast<std::size_t>(found - planes.begin())].index;
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

// Whether the patch bends little at the edge from its corner to triangle i's next point. Then an original
// triangle whose points are near the patch is near it at the edge too.
bool DeviationGuard::is_nearly_flat(std::size_t i, std::span<const Plane> planes,
                                    std::span<const PatchTriangle> patch) const {
    const auto is_beside = [&](const PatchTriangle& t) { return t.points[2] == patch[i].points[1]; };
    std::size_t beside = i > 0 ? i - 1 : patch.size() - 1;
    if (!is_beside(patch[beside]))
        beside =
            static_cast<std::size_t>(std::find_if(patch.begin(), patch.end(), is_beside) - patch.begin());
    if (beside == patch.size()) return false;
    const Plane &a = planes[i], &b = planes[beside];
    const Vec3d bend = cross(a.n, b.n);
    return dot(a.n, b.n) > 0 && dot(bend, bend) <= most_bend_ * a.nn * b.nn;
}

// Lists the common corner and the middle of each new edge at which the patch bends, each with the nearest of
// the patch's points. Within a triangle the patch is flat, so it is furthest from the original at the
// original points, or where it bends itself.
void DeviationGuard::list_positions(std::vector<Position>& positions, std::span<const Assignment> assignments,
                                    std::span<const Plane> planes,
                                    std::span<const PatchTriangle> patch) const {
    positions.clear();
    positions.push_back({patch.front().corners[0]});
    for (std::size_t i = 0; i < patch.size(); ++i) {
        if (!is_nearly_flat(i, planes, patch))
            positions.push_back({0.5 * (patch[i].corners[0] + patch[i].corners[1])});
    }
    for (Position& position : positions) {
        double least = std::numeric_limits<double>::infinity();
        for (const Assignment& a : assignments) {
            const Vec3d difference = a.position - position.at;
            if (const double d = dot(difference, difference); d < least)
                least = d, position.nearest = a.point;
        }
        if (position.nearest != kNone) hwy::Prefetch(fan_of(position.nearest).data());
    }
}

// A position mostly is above or below one of the triangles at its nearest point. These triangles may be
// anywhere in memory, so they are fetched for all positions at once.
bool DeviationGuard::patch_is_near(std::span<const Position> positions) const {
    for (const Position& position : positions) {
        if (position.nearest == kNone) continue;
        for (const std::uint32_t p : fan_of(position.nearest)) hwy::Prefetch(&mesh_.points[p]);
    }
    return std::all_of(positions.begin(), positions.end(),
                       [&](const Position& position) { return is_near(position); });
}

// Whether a position is near the original surface.
bool DeviationGuard::is_near(const Position& position) const {
    const double most = max_distance_ * max_distance_;
    if (position.nearest != kNone && !fan_of(position.nearest).empty()) {
        const Vec3d p = to_double(listed_[position.nearest].position);
        const std::span<const std::uint32_t> fan = fan_of(position.nearest);
        Vec3d q = to_double(mesh_.points[fan.back()]);
        for (const std::uint32_t next : fan) {
            const Vec3d r = to_double(mesh_.points[next]);
            if (is_across(position.at, p, q, r, most)) return true;
            q = r;
        }
    }
    return tree_.is_within(position.at, max_distance_);
}

}  // namespace marrow::internal
