/// Finds the component that another one is in.
#pragma once

#include <cstdint>

#include <marrow/mesh.h>

#include "find_components.h"
#include "mesh/search/triangle_tree.h"

namespace marrow::internal {

/// Returns the smallest component around another one, an index into `components.all`, or Components::kNone.
/// `components` and `tree` are those of the mesh.
std::uint32_t component_around(const Component& inner, const MeshView& mesh, const Components& components,
                               const TriangleTree& tree);

}  // namespace marrow::internal
