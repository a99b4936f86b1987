/// Smoothing stencils: for each point that moves, the neighbours whose mean it moves towards.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <marrow/buffer.h>

#include "surface_net.h"

namespace marrow::internal {

/// A point that moves, and its neighbours. Missing ones are replaced by the point after all others, which
/// stays at 0.
template <std::size_t kMaxNeighbours>
struct Stencil {
    std::uint32_t point, faces;  ///< faces as CellPattern::neighbours
    std::array<std::uint32_t, kMaxNeighbours> neighbours;
};

/// The stencils of a slice of cells. Most points have four neighbours; shorter stencils are faster.
struct SliceStencils {
    Buffer<Stencil<4>> up_to_four;
    std::size_t up_to_four_count = 0;  ///< the elements of up_to_four in use
    Buffer<Stencil<6>> more;
};

/// How one pass moves points, by the faces of their stencils. Positions are relative to cells, so the steps
/// between cells count.
struct PassTable {
    float keep;  ///< factor of a point's own position
    /// The first three: the sum of the steps to the neighbours' cells, times the fourth. The fourth: the
    /// factor of the sum of the neighbours' positions.
    std::array<NetPoint, 64> by_faces;
};

/// Lists the stencils of each slice of cells.
std::vector<SliceStencils> make_stencils(const SurfaceNet& net);

}  // namespace marrow::internal
