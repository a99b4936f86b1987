/// Decides how the surface of the trilinear interpolant passes through a cell.
///
/// The inside bits alone do not say whether the two inside corners of an ambiguous face are joined, nor
/// whether two parts of the surface in a cell are joined by a tunnel. The samples do: faces by the asymptotic
/// decider (Nielson and Hamann 1991) without its division, tunnels by Cayley's hyperdeterminant. Every
/// decision is exact, and ties have one rule: everything is decided as if the isovalue were lower by an
/// infinitely small amount. So a tie joins the inside, as a sample that equals the isovalue is inside.
#pragma once

#include <array>
#include <cstdint>

#include "case_table.h"
#include "face_signs.h"

namespace marrow::internal {

/// The topology of the surface in a cell.
struct CellTopology {
    /// The loops of `shape` that a tunnel joins. Bit a of `positive_faces` is set if the determinants of the
    /// cell's two faces across axis a, which have the same sign, are positive.
    struct Tunnel {
        std::uint8_t first_loop : 2 = 0, second_loop : 2 = 0, positive_faces : 3 = 0;
    };

    /// The points of a tunnel, in a cell without triangles that fill the loops at its ends.
    static constexpr int kTunnelPoints = 6;

    std::uint16_t shape_number = 0;  ///< in kShapes
    Tunnel tunnel{};
    std::uint8_t inner_points = 0;  ///< 1 of a fan, or kTunnelPoints

    const CellShape& shape() const { return kShapes[shape_number]; }
    bool has_tunnel() const { return inner_points == kTunnelPoints; }
    /// A loop of k points has k - 2 triangles; an inner point adds two, and a tunnel four.
    int triangles() const;
    /// Whether the inside bits alone give the same.
    bool is_default(unsigned cell_case) const {
        return shape_number == kFirstShape[cell_case] && !has_tunnel();
    }
};

/// Decides the first `count` cells of a batch. \pre a corner is inside exactly if its value is >= 0
void decide_topologies(const CellBatch& batch, const std::uint8_t (&cases)[CellBatch::kCells],
                       std::size_t count, CellTopology* topologies);

/// The same for one cell.
CellTopology decide_topology(unsigned cell_case, const CellValues& values);

/// Scales values by a power of two if they are very large or small, so that no product of four overflows or
/// underflows. Only values below 2^-440 of the largest get a little larger, which is beyond the range of
/// float32.
CellValues well_scaled(const CellValues& values);

/// On one axis, the values of the faces at its sides 0 and 1, and what their determinants are made of. The
/// slice at t between them has the determinant (1 - t)^2 d0 + t (1 - t) mixed + t^2 d1. Where it is 0, the
/// slice's contour is a cross.
struct OppositeFaces {
    double p00, p01, p10, p11, q00, q01, q10, q11;

    OppositeFaces(const CellValues& f, unsigned axis);

    double d0() const { return p00 * p11 - p01 * p10; }
    double d1() const { return q00 * q11 - q01 * q10; }
    double mixed() const { return (p00 * q11 + p11 * q00) - (p01 * q10 + p10 * q01); }
};

}  // namespace marrow::internal
