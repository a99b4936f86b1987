/// Decides whether the triangles of a tunnel pass through each other.
#pragma once

#include <cstddef>

#include "tunnel_triangles.h"

namespace marrow::internal {

/// Whether two of the triangles pass through or touch each other, or might once their points are rounded.
/// \pre the triangles are those of a cell with so many loops, whose points are in the faces of the cell
bool have_crossings(const TunnelTriangles& triangles, const TunnelTriangles::Points& points,
                    std::size_t loops);

}  // namespace marrow::internal
