/// Finds the component that a cavity is in.
#pragma once

#include <cstdint>

#include <marrow/mesh.h>

#include "find_components.h"
#include "mesh/search/triangle_tree.h"

namespace marrow::internal {

/// Returns the smallest component around a cavity, an index into `components.all`, or Components::kNone.
/// `components` and `tree` are those of the mesh.
std::uint32_t component_around(const Component& cavity, const MeshView& mesh, const Components& components,
                               const TriangleTree& tree);

}  // namespace marrow::internal
