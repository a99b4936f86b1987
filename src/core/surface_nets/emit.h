/// Makes the meshes of labels from a surface net.
#pragma once

#include <cstdint>
#include <vector>

#include <marrow/buffer.h>
#include <marrow/mesh.h>
#include <marrow/progress.h>

#include "core/grid/index_to_physical.h"
#include "surface_net.h"

namespace marrow::internal {

/// The meshes of labels, and for each of their points its index in the net.
struct LabelMeshes {
    std::vector<Mesh> meshes;
    std::vector<Buffer<std::uint32_t>> net_points;
};

/// Makes a mesh for each label of the net, without normals; the background's is empty. Fills in net.corners.
/// Uses up the counts of the net's slabs.
LabelMeshes make_label_meshes(SurfaceNet& net, const IndexToPhysical& to_physical, LabelIndex background,
                              const Progress& progress);

/// The same for a net after relax(). Where the net would pass through itself, points go back towards where they
/// were before, in the meshes of all labels that share them.
std::vector<Mesh> make_relaxed_meshes(SurfaceNet& net, const IndexToPhysical& to_physical,
                                      LabelIndex background, const Progress& progress);

}  // namespace marrow::internal
