// Follows a ray from a component, and counts where it crosses each component.
#include "component_around.h"

#include <cmath>
#include <limits>
#include <map>

#include "mesh/geometry/triangle_corners.h"

namespace marrow::internal {

namespace {

// The same in one direction. The ray crosses each closed component around the inner one an odd number of
// times. It may leave an open one where that has no triangles, so the first crossing says whether the inner
// one is inside.
std::uint32_t component_along(const Vec3d& direction, const Component& inner, const MeshView& mesh,
                              const Components& components, const TriangleTree& tree) {
    struct Crossings {
        int count = 0;
        double first = std::numeric_limits<double>::infinity();
        bool leaves = false;
    };
    const Vec3d origin = centroid(corners_of(mesh, mesh.triangles[inner.first_triangle]));
    std::map<std::uint32_t, Crossings> crossings;
    tree.for_each_hit(origin, direction, std::numeric_limits<double>::infinity(),
                      [&](double distance, std::uint32_t t) {
                          Crossings& c = crossings[components.of(mesh.triangles[t])];
                          ++c.count;
                          if (distance >= c.first) return;
                          c.first = distance;
                          c.leaves = dot(scaled_normal(corners_of(mesh, mesh.triangles[t])), direction) > 0;
                      });
    std::uint32_t closed = Components::kNone, open = Components::kNone;
    for (const auto& [index, crossing] : crossings) {
        const Component& c = components.all[index];
        if (c.closed && crossing.count % 2 != 0 && &c != &inner &&
            (closed == Components::kNone || std::abs(c.volume) < std::abs(components.all[closed].volume)))
            closed = index;
        if (!c.closed && crossing.leaves &&
            (open == Components::kNone || crossing.first < crossings.at(open).first))
            open = index;
    }
    return closed != Components::kNone ? closed : open;
}

}  // namespace

std::uint32_t component_around(const Component& inner, const MeshView& mesh, const Components& components,
                               const TriangleTree& tree) {
    const Vec3d direction{0.8361, 0.4227, 0.3498};  // not parallel to edges of the sampling grid
    const std::uint32_t around = component_along(direction, inner, mesh, components, tree);
    // The ray may have left through the opening; the opposite one need not.
    return around != Components::kNone ? around
                                       : component_along(-1.0 * direction, inner, mesh, components, tree);
}

}  // namespace marrow::internal
