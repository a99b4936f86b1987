/// Keeps a surface from passing through itself while its edges are collapsed.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <marrow/buffer.h>
#include <marrow/mesh.h>

#include "collapse_guard.h"
#include "edge_collapse.h"
#include "mesh/intersections/self_intersections.h"

namespace marrow::internal {

/// Accepts a collapse only if the changed triangles pass through no other ones. So edges stay where the
/// surface passed through itself before.
class IntersectionGuard : public CollapseGuard {
  public:
    /// Guards what follows `now`, a result of a reduction of `original`.
    IntersectionGuard(const Mesh& original, EdgeCollapse::Result now);

    bool accept(std::span<const std::uint32_t> removed, std::span<const PatchTriangle> patch) override;

  private:
    Mesh mesh_;
    Buffer<std::uint32_t> point_, triangle_;  // of the original mesh: which one of this mesh
    SelfIntersections search_;
    // Of the current patch; kept for their memory.
    std::vector<std::uint32_t> changed_;
    std::vector<Triangle> before_;
};

}  // namespace marrow::internal
