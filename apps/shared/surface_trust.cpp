// Collects what is written of how far a surface can be trusted.
#include "surface_trust.h"

#include <utility>

namespace marrow::apps {

SurfaceTrust surface_trust(TrustReport report, bool hounsfield, const Volume& scan,
                           std::span<const Vec3f> points, const ThinWalls* thin_walls) {
    std::vector<bool> near(points.size());
    if (thin_walls != nullptr) near = near_thin_walls(scan, *thin_walls, points);
    std::vector<Rgb8> colours = trust_colours(report, near);
    return {std::move(report), hounsfield, {near.begin(), near.end()}, std::move(colours)};
}

void add_trust(const SurfaceTrust& trust, ThinWallState thin_walls, MeshObject& object) {
    object.arrays = trust_arrays(trust.report, trust.near_thin_walls, thin_walls, trust.hounsfield);
    object.point_colours = trust.colours;
}

}  // namespace marrow::apps
