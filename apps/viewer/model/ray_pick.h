// Where a ray meets a mesh.
#pragma once

#include <optional>

#include <marrow/mesh.h>
#include <marrow/volume.h>

namespace marrow::viewer {

struct Ray {
    Vec3d origin, direction;

    Vec3d at(double t) const {
        return {origin[0] + t * direction[0], origin[1] + t * direction[1], origin[2] + t * direction[2]};
    }
};

/// The side of a plane that its normal points to.
struct HalfSpace {
    Vec3d point, normal;

    double height(const Vec3d& p) const {
        return (p[0] - point[0]) * normal[0] + (p[1] - point[1]) * normal[1] + (p[2] - point[2]) * normal[2];
    }
};

/// The smallest t >= 0 at which the ray meets the mesh, in `kept` where given. Tries every triangle: some 10 ms for a
/// million, which is less than keeping a search tree for every isovalue.
std::optional<double> first_hit(const Mesh& mesh, const Ray& ray, const std::optional<HalfSpace>& kept);

}  // namespace marrow::viewer
