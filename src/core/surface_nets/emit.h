/// Makes the meshes of labels from a surface net.
#pragma once

#include <cstdint>
#include <vector>

#include <marrow/buffer.h>
#include <marrow/mesh.h>
#include <marrow/progress.h>

#include "core/grid/index_to_physical.h"
#include "label_meshes.h"
#include "surface_net.h"

namespace marrow::internal {

/// Makes a mesh for each label of the net, without normals; the background's is empty. Fills in net.corners.
/// Uses up the counts of the net's slabs.
LabelMeshes make_label_meshes(SurfaceNet& net, const IndexToPhysical& to_physical, LabelIndex background,
                              const Progress& progress);

/// The counts of the net's slabs, to be kept before they are used up.
std::vector<std::vector<SurfaceCounts>> counts_of(const SurfaceNet& net);

/// Where the points of a net would be without relax(). `counts` are those of counts_of(). Drops net.points.
Buffer<Vec3f> positions_before_relaxation(SurfaceNet& net, std::vector<std::vector<SurfaceCounts>> counts,
                                          const IndexToPhysical& to_physical, LabelIndex background,
                                          const Progress& progress);

/// The meshes of make_label_meshes() for a net after relax(), held back by hold_back_labels().
LabelMeshes make_relaxed_meshes(SurfaceNet& net, const IndexToPhysical& to_physical, LabelIndex background,
                                const Progress& progress);

}  // namespace marrow::internal
