#include "deviation_guard.h"

#include "triangle_distance.h"

namespace marrow::internal {

DeviationGuard::DeviationGuard(const Mesh& mesh, const TriangleTree& tree, double max_distance)
    : tree_(tree),
      max_distance_(max_distance),
      first_point_(mesh.triangles.size(), kNone),
      next_point_(mesh.points.size(), kNone) {
    points_.reserve(mesh.points.size());
    for (const Vec3f& p : mesh.points) points_.push_back(to_double(p));
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
        double nearest = std::numeric_limits<double>::infinity();
        for (const PlacedTriangle& t : patch) {
            const double d = squared_distance_to_triangle(points_[move.point], t.a, t.b, t.c);
            if (d < nearest) nearest = d, move.triangle = t.index;
        }
        if (!(nearest <= max_distance_ * max_distance_)) return false;
    }
    return true;
}

// Looks at the place that they share, and at the middle and one of the edges that are new of each.
bool DeviationGuard::patch_is_near(std::span<const PlacedTriangle> patch) const {
    const auto near = [&](const Vec3d& place) {
        return tree_.distance(place, max_distance_) <= max_distance_;
    };
    if (patch.empty() || !near(patch.front().a)) return false;
    for (const PlacedTriangle& t : patch) {
        if (!near((1.0 / 3) * (t.a + t.b + t.c)) || !near(0.5 * (t.a + t.b))) return false;
    }
    return true;
}

}  // namespace marrow::internal
