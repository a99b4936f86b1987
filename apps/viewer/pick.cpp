#include "pick.h"

#include <limits>

namespace marrow::viewer {
namespace {

Vec3d minus(const Vec3f& a, const Vec3d& b) {
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

Vec3d cross(const Vec3d& a, const Vec3d& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

double dot(const Vec3d& a, const Vec3d& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

}  // namespace

// Moeller and Trumbore 1997.
std::optional<double> first_hit(const Mesh& mesh, const Ray& ray, const std::optional<HalfSpace>& kept) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Triangle& t : mesh.triangles) {
        const Vec3d a = minus(mesh.points[t[0]], ray.origin);
        const Vec3d ab =
            minus(mesh.points[t[1]], {mesh.points[t[0]][0], mesh.points[t[0]][1], mesh.points[t[0]][2]});
        const Vec3d ac =
            minus(mesh.points[t[2]], {mesh.points[t[0]][0], mesh.points[t[0]][1], mesh.points[t[0]][2]});
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
        if (kept && kept->height(ray.at(along)) < 0) continue;
        nearest = along;
    }
    if (nearest == std::numeric_limits<double>::infinity()) return {};
    return nearest;
}

}  // namespace marrow::viewer
