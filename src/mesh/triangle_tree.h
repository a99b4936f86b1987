/// The nearest place on a mesh.
#pragma once

#include <cstddef>
#include <vector>

#include <marrow/mesh.h>
#include <marrow/volume.h>

namespace marrow::internal {

/// A copy of a mesh's triangles under a balanced binary tree of boxes, parted at the median of the longest
/// axis.
class TriangleTree {
  public:
    /// \pre mesh has triangles, and they name points that are there
    explicit TriangleTree(const Mesh& mesh);

    /// The distance from a place to the nearest one on a triangle.
    double distance(const Vec3d& place) const;

  private:
    struct Corners {
        Vec3f a, b, c;
    };
    struct Box {
        Vec3f lower, upper;
    };
    void part(std::size_t node, std::size_t first, std::size_t size);
    double squared_distance_to_box(std::size_t node, const Vec3d& place) const;
    double squared_distance_to_leaf(std::size_t leaf, const Vec3d& place) const;

    std::vector<Corners> triangles_;  ///< in the order of the leaves, kLeafSize each
    std::size_t leaves_;              ///< a power of two; the last ones may be empty
    std::vector<Box> boxes_;          ///< node 1 is the root, those below n are 2 n and 2 n + 1
};

}  // namespace marrow::internal
