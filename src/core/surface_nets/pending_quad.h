/// Quads of crossed edges before they are written.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "cell_patterns.h"

namespace marrow::internal {

/// The quad of a crossed edge: the corners in the four cells around the edge, counter-clockwise seen from the
/// edge's upper end, and the first again. The edge begins at corner 0 of the third cell.
struct alignas(32) PendingQuad {
    std::array<std::uint32_t, 5> corners;
    std::uint32_t axis;  ///< of the edge
};

/// For each axis the two others.
inline constexpr std::array<std::array<std::size_t, 2>, 3> kOtherAxes = {{{1, 2}, {2, 0}, {0, 1}}};

/// For the axis of an edge and each of the four cells around it, in the order of PendingQuad: the edges of
/// the cell with lower numbers than this edge.
inline constexpr std::array<std::array<std::uint32_t, 4>, 3> kEdgesBefore = [] {
    // The steps from the third cell to each cell, along the other axes.
    constexpr int kSteps[4][2] = {{-1, -1}, {0, -1}, {0, 0}, {-1, 0}};
    std::array<std::array<std::uint32_t, 4>, 3> before{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto [u, v] = kOtherAxes[axis];
        for (std::size_t c = 0; c < 4; ++c) {
            const int corner = (kSteps[c][0] < 0 ? 1 << u : 0) | (kSteps[c][1] < 0 ? 1 << v : 0);
            before[axis][c] = (1u << edge_between(corner, corner | 1 << axis)) - 1;
        }
    }
    return before;
}();

/// Whether the diagonal of a quad from a to c is not longer than that from b to d.
inline bool first_diagonal_is_shorter(const NetPoint& a, const NetPoint& b, const NetPoint& c,
                                      const NetPoint& d) {
    float difference = 0;
    for (std::size_t i = 0; i < 3; ++i) {
        const float first = a.xyz[i] - c.xyz[i], second = b.xyz[i] - d.xyz[i];
        difference += first * first - second * second;
    }
    return difference <= 0;
}

}  // namespace marrow::internal
