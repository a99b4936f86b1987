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
    // Counted two slots on, so that filling leaves fan_begin_[p] at the begin of p's fan.
    for (const Triangle& t : mesh.triangles) {
        for (const std::uint32_t p : t) ++fan_begin_[p + std::size_t{2}];
    }
    std::partial_sum(fan_begin_.begin(), fan_begin_.end(), fan_begin_.begin());
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
        for (const std::uint32_t p : mesh.triangles[t]) fans_[fan_begin_[p + std::size_t{1}]++] = t;
    }
    std::vector<bool> placed(mesh.points.size(), false);
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
        for (const std::uint32_t p : mesh.triangles[t]) {
            if (placed[p]) continue;
            placed[p] = true;
            next_point_[p] = first_point_[t];
            first_point_[t] = p;
        }
    }
}

bool DeviationGuard::accept(std::span<const std::uint32_t> gone, std::span<const PlacedTriangle> patch) {
    moves_.clear();
    const auto list = [&](std::uint32_t triangle) {
        for_each_point_of(triangle, [&](std::uint32_t p) { moves_.push_back({p, kNone}); });
    };
    for (const std::uint32_t t : gone) list(t);
    for (const PlacedTriangle& t : patch) list(t.index);
    if (!points_stay_near(patch) || !patch_is_near(patch)) return false;
    for (const std::uint32_t t : gone) first_point_[t] = kNone;
    for (const PlacedTriangle& t : patch) first_point_[t.index] = kNone;
    for (const Move& move : moves_) {
        next_point_[move.point] = first_point_[move.triangle];
        first_point_[move.triangle] = move.point;
    }
    return true;
}

// Finds the triangle of the patch that each point belongs to from now on.
bool DeviationGuard::points_stay_near(std::span<const PlacedTriangle> patch) {
    for (Move& move : moves_) {
        double nearest = max_distance_ * max_distance_;
        for (const PlacedTriangle& t : patch) {
            const double d = squared_distance_to_triangle(points_[move.point], t.a, t.b, t.c);
            if (d <= nearest) nearest = d, move.triangle = t.index;
        }
        if (move.triangle == kNone) return false;
    }
    return true;
}

// Looks at the place that they share, and of each at the middle of one of the edges that are new and at three places inside.
bool DeviationGuard::patch_is_near(std::span<const PlacedTriangle> patch) const {
    if (patch.empty() || !is_near(patch.front().a)) return false;
    for (const PlacedTriangle& t : patch) {
        if (!is_near(0.5 * (t.a + t.b))) return false;
        if (!is_near((1.0 / 6) * (4 * t.a + t.b + t.c)) || !is_near((1.0 / 6) * (t.a + 4 * t.b + t.c)) ||
            !is_near((1.0 / 6) * (t.a + t.b + 4 * t.c)))
            return false;
    }
    return true;
}

// Whether the surface at first comes near a place of the patch: mostly it does so round the nearest of the points
// that belong to the patch, else anywhere.
bool DeviationGuard::is_near(const Vec3d& place) const {
    const double most = max_distance_ * max_distance_;
    double least = std::numeric_limits<double>::infinity();
    std::uint32_t nearest = kNone;
    for (const Move& move : moves_) {
        const Vec3d apart = points_[move.point] - place;
        if (const double d = dot(apart, apart); d < least) least = d, nearest = move.point;
    }
    if (nearest != kNone) {
        for (std::size_t i = fan_begin_[nearest]; i < fan_begin_[nearest + std::size_t{1}]; ++i) {
            const Triangle& t = mesh_.triangles[fans_[i]];
            if (squared_distance_to_triangle(place, points_[t[0]], points_[t[1]], points_[t[2]]) <= most)
                return true;
        }
    }
    return tree_.is_within(place, max_distance_);
}

}  // namespace marrow::internal
