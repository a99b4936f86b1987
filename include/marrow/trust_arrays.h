/// How far the points of a surface can be trusted, as mesh files hold it.
#pragma once

#include <span>
#include <vector>

#include <marrow/export.h>
#include <marrow/mesh_io.h>
#include <marrow/trust.h>

namespace marrow {

/// What is known of walls that are too thin for the scan, beside a surface.
enum class ThinWallState {
    unknown,  ///< they were not looked for
    found,
    restored  ///< the surface was extracted from restore_thin_walls()
};

/// Three arrays for MeshObject::arrays: `shift_mm` and `noise_mm` of `report`, and `thin_wall`,
/// which is 1 for points of near_thin_walls() and 0 for others. They borrow `report` and
/// `near_thin_walls`, which has one number for each point. `hounsfield` says that the samples are in
/// HU, as the meanings of the arrays then state. Where the noise is unknown, `noise_mm` is 0, and its
/// meaning says so.
MARROW_EXPORT std::vector<PointArray> trust_arrays(const TrustReport& report,
                                                   std::span<const float> near_thin_walls,
                                                   ThinWallState thin_walls, bool hounsfield);

}  // namespace marrow
