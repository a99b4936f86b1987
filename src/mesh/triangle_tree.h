/// The nearest place on a mesh.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <marrow/mesh.h>
#include <marrow/volume.h>

namespace marrow::internal {

/// The triangles of a mesh under a binary tree of boxes, in the order of a space-filling curve, so that close
/// triangles share small boxes. The mesh must outlive it.
class TriangleTree {
  public:
    /// \pre mesh has triangles, and they name points that are there
    explicit TriangleTree(const Mesh& mesh);

    /// The distance from a place to the nearest one on a triangle.
    double distance(const Vec3d& place) const;

  private:
    struct Box {
        Vec3f lower, upper;
    };
    double squared_distance_to_leaf(std::size_t leaf, const Vec3d& place) const;

    const Mesh& mesh_;
    std::vector<std::uint32_t> order_;  ///< triangles along the curve; kLeafSize a leaf
    std::size_t leaves_;                ///< a power of two
    std::vector<Box> boxes_;            ///< node 1 is the root, those below n are 2 n and 2 n + 1
};

}  // namespace marrow::internal
