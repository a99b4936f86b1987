/// Makes the meshes of labels from a surface net.
#pragma once

#include <vector>

#include <marrow/mesh.h>

#include "core/grid/index_to_physical.h"
#include "surface_net.h"

namespace marrow::internal {

/// Makes a mesh for each label of the net, without normals; the background's is empty. Fills in net.corners.
/// Uses up the counts of the net's slabs.
std::vector<Mesh> make_label_meshes(SurfaceNet& net, const IndexToPhysical& to_physical,
                                    LabelIndex background, const Progress& progress);

}  // namespace marrow::internal
