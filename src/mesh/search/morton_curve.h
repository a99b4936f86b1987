/// Orders triangles so that triangles which follow each other are near each other.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <marrow/buffer.h>
#include <marrow/mesh.h>

#include "mesh/geometry/bounds.h"

namespace marrow::internal {

/// Moves the 10 lower bits of a number apart, so that there are two zeros between them. Three such numbers
/// make a key, one for each axis.
constexpr std::uint32_t spread_bits(std::uint32_t x) {
    x = (x | x << 16) & 0x030000ff;
    x = (x | x << 8) & 0x0300f00f;
    x = (x | x << 4) & 0x030c30c3;
    return (x | x << 2) & 0x09249249;
}

/// Numbers the cells of a grid over bounds by their keys.
class CellKeys {
  public:
    /// The bounds are at most `across` cells wide, and the last cell along an axis has the number `last`.
    /// Positions are given as the sums of `summed` positions.
    CellKeys(const Bounds& bounds, float across, float last, float summed = 1) : last_(last) {
        const float width = bounds.width();
        scale_ = width > 0 ? across / (summed * width) : 0;
        for (std::size_t axis = 0; axis < 3; ++axis) lower_[axis] = summed * bounds.lower[axis];
    }
    /// Positions outside of the grid have the key of a cell at its border.
    std::uint32_t at(const Vec3f& sum) const {
        std::uint32_t key = 0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const float cell = (sum[axis] - lower_[axis]) * scale_;
            key |= spread_bits(cell > 0 ? static_cast<std::uint32_t>(std::min(cell, last_)) : 0) << axis;
        }
        return key;
    }

  private:
    Vec3f lower_;
    float scale_, last_;
};

/// A triangle and its position on the Morton curve. The key numbers the cell of the triangle's centre in a
/// grid of 1024^3 cells over the mesh. Its three highest bits choose an eighth of the grid, one bit per axis,
/// the next three an eighth of that, and so on.
struct MortonKey {
    std::uint32_t key, triangle;
};

/// Returns the triangles sorted by key. Triangles with the same key keep their order. After Morton 1966.
/// \pre fewer than 2^32 triangles, whose indices are in range
Buffer<MortonKey> along_morton_curve(const MeshView& mesh);

/// Returns the triangles sorted by the cells of their first corners, in a grid of 64^3 cells or fewer,
/// along the same curve. Takes less time, on all threads, and serves meshes whose successive triangles are
/// near each other within a cell. Triangles of the same cell keep their order. \pre fewer than 2^32
/// triangles, whose indices are in range
Buffer<std::uint32_t> by_morton_cells(const MeshView& mesh);

}  // namespace marrow::internal
