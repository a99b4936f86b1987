/// From a label map's net to its labels' meshes.
#pragma once

#include <vector>

#include <marrow/mesh.h>

#include "core/grid/index_to_physical.h"
#include "surface_net.h"

namespace marrow::internal {

/// Takes the net's points into space, parts them by labels, and joins them with triangles. The mesh of `background` stays empty.
/// Takes two steps of the stage for each piece. \throw LimitError
std::vector<Mesh> emit(LabelNet& net, const IndexToPhysical& frame, Place background, Stage& stage);

}  // namespace marrow::internal
