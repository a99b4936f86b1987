/// Opens folds of relaxed surface nets.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include <marrow/buffer.h>
#include <marrow/mesh.h>
#include <marrow/progress.h>

namespace marrow::internal {

/// Folds: edges where two triangles lie on each other. A fold passes through nothing, but the surface of
/// another label that begins at the edge is then on the wrong side of one of the two triangles.
class Folds {
  public:
    /// Lists the edges of a net. Only its points may change later. \throw Cancelled
    Folds(Mesh& net, const Progress& progress);

    /// Moves the corners of both triangles back along straight paths, towards the positions that they came
    /// from, until there are no folds except those that there were at the start. Returns whether it moved
    /// any. `start` returns the positions at the start, which it keeps; it is called only if they are
    /// needed. The result does not depend on the number of threads. How often it has to look is not known
    /// before, so it calls `progress` only to be cancelled. \throw Cancelled
    bool open(const std::function<std::span<const Vec3f>()>& start, const Progress& progress);

  private:
    // Two triangles at an edge: both ends of the edge, and the corners opposite to it.
    using Hinge = std::array<std::uint32_t, 4>;
    // A triangle's edge, seen from its lower end.
    struct Side {
        std::uint32_t end, opposite;
    };

    static bool is_folded(std::span<const Vec3f> points, const Hinge& hinge);
    std::vector<Hinge> find(const Progress& progress) const;

    Mesh& net_;
    Buffer<std::size_t> first_;  // the first side of each point
    Buffer<Side> sides_;
};

}  // namespace marrow::internal
