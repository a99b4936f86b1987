// Changes a copy of the surface, searches it for intersections, and changes it back if there are some.
#include "intersection_guard.h"

#include <utility>

namespace marrow::internal {

IntersectionGuard::IntersectionGuard(const Mesh& original, EdgeCollapse::Result now)
    : mesh_(std::move(now.mesh)),
      point_(original.points.size()),
      triangle_(original.triangles.size()),
      search_(mesh_) {
    for (std::uint32_t p = 0; p < now.old_points.size(); ++p) point_[now.old_points[p]] = p;
    for (std::uint32_t t = 0; t < now.old_triangles.size(); ++t) triangle_[now.old_triangles[t]] = t;
}

bool IntersectionGuard::accept(std::span<const std::uint32_t> removed, std::span<const PatchTriangle> patch) {
    if (patch.empty()) return true;
    Vec3f& moved = mesh_.points[point_[patch.front().points[0]]];
    const Vec3f moved_from = std::exchange(moved, to_float(patch.front().corners[0]));
    for (const std::uint32_t t : removed) search_.remove(triangle_[t]);
    changed_.clear();
    before_.clear();
    for (const PatchTriangle& t : patch) {
        changed_.push_back(triangle_[t.index]);
        const Triangle now{point_[t.points[0]], point_[t.points[1]], point_[t.points[2]]};
        before_.push_back(std::exchange(mesh_.triangles[changed_.back()], now));
    }
    if (!search_.any_changed_pair(changed_)) return true;
    moved = moved_from;
    for (std::size_t i = 0; i < changed_.size(); ++i) mesh_.triangles[changed_[i]] = before_[i];
    for (const std::uint32_t t : removed) changed_.push_back(triangle_[t]);
    search_.update(changed_);
    return false;
}

}  // namespace marrow::internal
