/// What both programs write of how far a surface can be trusted.
#pragma once

#include <span>
#include <vector>

#include <marrow/mesh.h>
#include <marrow/mesh_io.h>
#include <marrow/thin_walls.h>
#include <marrow/trust.h>
#include <marrow/trust_arrays.h>
#include <marrow/volume.h>

namespace marrow::apps {

/// How far a surface can be trusted, as written with it.
struct SurfaceTrust {
    TrustReport report;
    bool hounsfield = false;             ///< the samples are in HU
    std::vector<float> near_thin_walls;  ///< for each point 1 or 0
    std::vector<Rgb8> colours;           ///< for each point
};

/// `report` is that of `points`, which are of a surface of `scan`. `thin_walls` are those beside it;
/// null: they were not looked for.
SurfaceTrust surface_trust(TrustReport report, bool hounsfield, const Volume& scan,
                           std::span<const Vec3f> points, const ThinWalls* thin_walls);

/// Gives an object what is written with its points. It borrows `trust`.
void add_trust(const SurfaceTrust& trust, ThinWallState thin_walls, MeshObject& object);

}  // namespace marrow::apps
