// Assigns the original points to triangles, and measures distances around each change.
#include "deviation_guard.h"

#include <limits>
#include <numeric>

#include "triangle_distance.h"

namespace marrow::internal {

DeviationGuard::DeviationGuard(const Mesh& mesh, const TriangleTree& tree, double max_distance)
    : mesh_(mesh),
      tree_(tree),
      max_distance_(max_distance),
      first_point_(mesh.triangles.size(), kNone),
      next_point_(mesh.points.size(), kNone),
      fan_begin_(mesh.points.size() + 2, 0),
      fans_(3 * mesh.triangles.size()) {
    points_.reserve(mesh.points.size());
    for (const Vec3f& p : mesh.points) points_.push_back(to_double(p));
    // Counts go two entries further, so that filling leaves the first triangle of p in fan_begin_[p].
    for (const Triangle& t : mesh.triangles) {
        for (const std::uint32_t p : t) ++fan_begin_[p + std::size_t{2}];
    }
    std::partial_sum(fan_begin_.begin(), fan_begin_.end(), fan_begin_.begin());
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
        for (const std::uint32_t p : mesh.triangles[t]) fans_[fan_begin_[p + std::size_t{1}]++] = t;
    }
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
    assignments_.clear();
    const auto list = [&](std::uint32_t triangle, std::uint32_t guess) {
        for_each_point_of(triangle, [&](std::uint32_t p) { assignments_.push_back({p, kNone, guess}); });
    };
    for (const std::uint32_t t : removed) list(t, 0);
    for (std::uint32_t i = 0; i < patch.size(); ++i) list(patch[i].index, i);
    if (!points_stay_near(patch) || !patch_is_near(patch)) return false;
    for (const std::uint32_t t : removed) first_point_[t] = kNone;
    for (const PatchTriangle& t : patch) first_point_[t.index] = kNone;
    for (const Assignment& a : assignments_) {
        next_point_[a.point] = first_point_[a.triangle];
        first_point_[a.triangle] = a.point;
    }
    return true;
}

// Assigns each point to the nearest triangle of the patch, or to its former triangle if that is still quite
// near. False if one is too far from all of them.
bool DeviationGuard::points_stay_near(std::span<const PatchTriangle> patch) {
    const double most = max_distance_ * max_distance_;
    for (Assignment& a : assignments_) {
        double nearest = most;
        const auto try_triangle = [&](const PatchTriangle& t) {
            const auto& [p, q, r] = t.corners;
            const double d = squared_distance_to_triangle(points_[a.point], p, q, r);
            if (d <= nearest) nearest = d, a.triangle = t.index;
        };
        if (!patch.empty()) try_triangle(patch[a.guess]);
        for (std::size_t i = 0; i < patch.size() && !(4 * nearest < most); ++i) {
            if (i != a.guess) try_triangle(patch[i]);
        }
        if (a.triangle == kNone) return false;
    }
    return true;
}

// Samples the patch at its common corner, and each triangle at the middle of a new edge and at three interior
// points.
bool DeviationGuard::patch_is_near(std::span<const PatchTriangle> patch) const {
    if (patch.empty() || !is_near(patch.front().corners[0])) return false;
    for (const PatchTriangle& t : patch) {
        const auto& [p, q, r] = t.corners;
        if (!is_near(0.5 * (p + q))) return false;
        if (!is_near((1.0 / 6) * (4 * p + q + r)) || !is_near((1.0 / 6) * (p + 4 * q + r)) ||
            !is_near((1.0 / 6) * (p + q + 4 * r)))
            return false;
    }
    return true;
}

// Whether a position is near the original surface. It mostly is near the triangles at the nearest of the
// patch's points, so these come first.
bool DeviationGuard::is_near(const Vec3d& position) const {
    const double most = max_distance_ * max_distance_;
    double least = std::numeric_limits<double>::infinity();
    std::uint32_t nearest = kNone;
    for (const Assignment& a : assignments_) {
        const Vec3d difference = points_[a.point] - position;
        if (const double d = dot(difference, difference); d < least) least = d, nearest = a.point;
    }
    if (nearest != kNone) {
        for (std::size_t i = fan_begin_[nearest]; i < fan_begin_[nearest + std::size_t{1}]; ++i) {
            const Triangle& t = mesh_.triangles[fans_[i]];
            if (squared_distance_to_triangle(position, points_[t[0]], points_[t[1]], points_[t[2]]) <= most)
                return true;
        }
    }
    return tree_.is_within(position, max_distance_);
}

}  // namespace marrow::internal
