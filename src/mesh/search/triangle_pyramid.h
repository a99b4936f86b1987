/// Finds the pairs of triangles of a mesh whose bounding boxes overlap, with SIMD.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <marrow/buffer.h>
#include <marrow/mesh.h>

#include "mesh/geometry/bounds.h"

namespace marrow::internal {

/// The indices of two triangles, the lower index first.
using TrianglePair = std::array<std::uint32_t, 2>;

/// A bounding volume hierarchy without pointers: triangles that are near each other are put in a row, and
/// each box of a level bounds eight successive boxes of the level below.
class TrianglePyramid {
  public:
    static constexpr std::size_t kWidth = 8;

    /// `simple` is 1 for points at which no two triangles need to be looked at, and 0 for the others; if it
    /// is empty, no point is simple. \pre fewer than 2^32 triangles
    explicit TrianglePyramid(MeshView mesh, std::span<const std::uint8_t> simple = {});

    /// The number of parts of the work of pairs_from().
    std::size_t units() const { return levels_[0].size(); }

    /// Appends the pairs of triangles whose boxes overlap or touch and of which the first in the row is in
    /// the units [begin, end). Leaves out those that share a simple point. The order of the pairs is fixed.
    void pairs_from(std::size_t begin, std::size_t end, std::vector<TrianglePair>& pairs) const;

    /// Returns the triangles whose boxes overlap or touch a box, in a fixed order.
    std::vector<std::uint32_t> overlapping(const Bounds& box) const;

    /// Replaces the box of a triangle. An empty box overlaps nothing.
    void set_box(std::uint32_t triangle, const Bounds& box);

    /// Eight boxes by axis. Unused ones are empty and overlap nothing.
    struct Group {
        float lower[3][kWidth], upper[3][kWidth];

        void set(std::size_t i, const Bounds& box);
        Bounds box(std::size_t i) const;
        /// The bounds of all eight.
        Bounds bounds() const;
    };
    /// The boxes of eight triangles and what they belong to. Five cache lines, so that no vector is in two.
    struct Leaf {
        Group boxes;
        std::uint32_t corners[3][kWidth];
        std::uint32_t triangles[kWidth];
    };

  private:
    MeshView mesh_;
    Buffer<Leaf> leaves_;
    Buffer<std::uint8_t> simple_;  // a bit for each triangle of a leaf whose corners are all simple
    // The groups of the bounds of leaves, then the groups of the bounds of these, up to a single group.
    std::vector<Buffer<Group>> levels_;
    Buffer<std::uint32_t> places_;  // where in the row each triangle is; made when it is needed
};

}  // namespace marrow::internal
