// Intersects a ray with the triangles of a mesh.
#include "ray_pick.h"

#include <limits>

namespace marrow::viewer {
namespace {

Vec3d position(const Vec3f& p) {
    return {p[0], p[1], p[2]};
}

}  // namespace

// Moeller and Trumbore, "Fast, minimum storage ray-triangle intersection", 1997.
std::optional<double> first_hit(const Mesh& mesh, const Ray& ray, const std::optional<HalfSpace>& visible) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Triangle& t : mesh.triangles) {
        const Vec3d corner = position(mesh.points[t[0]]);
        const Vec3d a = corner - ray.origin;
        const Vec3d ab = position(mesh.points[t[1]]) - corner;
        const Vec3d ac = position(mesh.points[t[2]]) - corner;
        const Vec3d p = cross(ray.direction, ac);
        const double determinant = dot(ab, p);
        if (determinant == 0) continue;
        const double u = -dot(a, p) / determinant;
        if (!(u >= 0 && u <= 1)) continue;
        const Vec3d q = cross(ab, a);
        const double v = dot(ray.direction, q) / determinant;
        if (!(v >= 0 && u + v <= 1)) continue;
        const double along = dot(ac, q) / determinant;
        if (along < 0 || along >= nearest) continue;
        if (visible && visible->height(ray.at(along)) < 0) continue;
        nearest = along;
    }
    if (nearest == std::numeric_limits<double>::infinity()) return {};
    return nearest;
}

}  // namespace marrow::viewer
