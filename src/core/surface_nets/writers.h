/// Writers that append points and triangles to the meshes of labels.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <marrow/mesh.h>

#include "core/grid/index_to_physical.h"
#include "surface_net.h"

namespace marrow::internal {

/// Where a label's next point is written. The background's writer has step 0: each of its points overwrites
/// the one before.
struct PointWriter {
    Vec3f* points;
    std::uint32_t* net_points;
    std::uint32_t next, step;

    /// Returns the point's index in the label's mesh. `net_point` is its index in the net.
    std::uint32_t write(const NetPoint& position, std::size_t net_point) {
        const std::uint32_t index = next;
        net_points[index] = static_cast<std::uint32_t>(net_point);
        points[index] = {position.xyz[0], position.xyz[1], position.xyz[2]};
        next += step;
        return index;
    }
};

/// The points of a quad in a label's mesh.
using Quad = std::array<std::uint32_t, 4>;

/// Where a label's next triangle is written. The background's writer has step 0: each of its triangles
/// overwrites those before. A branch instead would be mispredicted at every other border.
struct TriangleWriter {
    Triangle* next;  ///< with room for two triangles
    std::size_t step;

    void write(const Triangle& triangle) {
        next[0] = triangle;
        next += step;
    }
    /// Writes the two triangles on both sides of the diagonal from the first point to the third.
    void write_quad(const Quad& q) { write_two({q[0], q[1], q[2]}, {q[0], q[2], q[3]}); }
    /// Writes the same triangles, facing the other way.
    void write_flipped_quad(const Quad& q) { write_two({q[0], q[3], q[2]}, {q[0], q[2], q[1]}); }

  private:
    void write_two(const Triangle& first, const Triangle& second) {
        next[0] = first;
        next[1] = second;
        next += 2 * step;
    }
};

/// Fills in the corners of a slab's cells, and writes their points to the meshes; `writers` has one for each
/// label.
void emit_label_points(SurfaceNet& net, const IndexToPhysical& to_physical, std::size_t slab,
                       PointWriter* writers);

/// Writes the quads of the edges that begin in slices [begin, end) of samples; `writers` has one for each
/// label. `mirrored` flips all triangles. \pre the corners of the cells in these slices, and in the one
/// before them, are filled in
void emit_label_quads(const SurfaceNet& net, bool mirrored, std::int64_t begin, std::int64_t end,
                      TriangleWriter* writers);

}  // namespace marrow::internal
