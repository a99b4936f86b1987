/// What decides whether an edge may be collapsed.
#pragma once

#include <cstdint>
#include <span>

#include <marrow/mesh.h>

#include "mesh/geometry/triangle_corners.h"

namespace marrow::internal {

/// A triangle around a collapsed edge, after the collapse.
struct PatchTriangle {
    std::uint32_t index;      ///< in the original mesh
    Triangle points;          ///< in the original mesh; the first is the point that the edge becomes
    TriangleCorners corners;  ///< the positions of these points
};

/// Looks at each collapse before it is done.
class CollapseGuard {
  public:
    virtual ~CollapseGuard() = default;

    /// Whether the triangles `removed` of the original mesh may vanish while those of `patch` change. If so,
    /// the collapse is done. If several threads ask, then about different triangles.
    virtual bool accept(std::span<const std::uint32_t> removed, std::span<const PatchTriangle> patch) = 0;
};

}  // namespace marrow::internal
