/// Smoothing stencils: for each point that moves, the neighbours whose mean it moves towards.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <marrow/buffer.h>

#include "surface_net.h"

namespace marrow::internal {

/// A point that moves, and its neighbours. A point after all others, which stays at 0, replaces missing ones.
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

/// The numbers of one pass. A point moves to
///
///     keep * (its position) + factor * (sum of its neighbours' positions) + step
///
/// where the step makes up for positions that are relative to different cells.
struct PassTable {
    float keep;
    std::array<NetPoint, 64> by_faces;  ///< by Stencil::faces, the step; its fourth number is the factor
};

/// Lists the stencils of each slice of cells. \throw Cancelled
std::vector<SliceStencils> make_stencils(const SurfaceNet& net, const Progress& progress);

}  // namespace marrow::internal
