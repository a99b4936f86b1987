/// Pass 3: crossed edges -> points and normals; active cells -> triangles.
#pragma once

#include <cstdint>
#include <vector>

#include <marrow/histo_pyramid.h>
#include <marrow/mesh.h>
#include <marrow/volume.h>

#include "core/grid/index_to_physical.h"
#include "inside_bits.h"

namespace marrow::internal {

/// What emission reads: the volume and the results of the passes before.
struct EmitInput {
    const VolumeView& volume;
    double isovalue;
    const IndexToPhysical& to_physical;
    const InsideBits& bits;
    const ActiveWords& active;
    const HistoPyramid& points;  ///< over the grid's rows, as RowCounts
    const HistoPyramid& triangles;
    const std::vector<std::uint32_t>& along_x;  ///< as RowCounts
    const std::vector<std::uint32_t>& along_y;
};

/// Writes the points, and unless these are null the normals and how far along its edge each point is, of the
/// rows [row_begin, row_end) to their places in the whole output. Order: rows by (z, y); in a row the edges
/// along x, then y, then z; among these by x. Behind the last of the fractions up to 16 more are written.
void emit_points(const EmitInput& input, std::size_t row_begin, std::size_t row_end, Vec3f* points,
                 Vec3f* normals, float* fractions = nullptr);

/// Writes the triangles of the rows of cells [row_begin, row_end) to their places. Order: cells by (z, y, x).
void emit_triangles(const EmitInput& input, std::size_t row_begin, std::size_t row_end,
                    Triangle* triangles);

}  // namespace marrow::internal
