/// The last pass: makes points and normals from crossed edges, and triangles from active cells.
#pragma once

#include <cstdint>
#include <vector>

#include <marrow/histo_pyramid.h>
#include <marrow/mesh.h>
#include <marrow/volume.h>

#include "ambiguous_cells.h"
#include "core/grid/index_to_physical.h"
#include "inside_bits.h"

namespace marrow::internal {

/// The input of emission: the volume, and the results of the first two passes.
struct EmitInput {
    const VolumeView& volume;
    double isovalue;
    const IndexToPhysical& to_physical;
    const InsideBits& bits;
    const ActiveWords& active;
    const HistoPyramid& points;                 ///< its leaves are RowCounts::points
    const HistoPyramid& triangles;              ///< its leaves are RowCounts::triangles
    const std::vector<std::uint32_t>& along_x;  ///< RowCounts::along_x
    const std::vector<std::uint32_t>& along_y;  ///< RowCounts::along_y
    const AmbiguousCells* ambiguous = nullptr;  ///< null without exact topology
};

/// Writes the points of the rows [row_begin, row_end) to their positions in the whole output. Writes their
/// normals and their fractions (the position of each point along its edge) too, unless these are null. Rows
/// are ordered by (z, y). In a row come first the edges along x, then y, then z, each in order of x,
/// and last the points inside the cells of the row. These have no fractions. Up to 16 values after the
/// last fraction are overwritten.
void emit_points(const EmitInput& input, std::size_t row_begin, std::size_t row_end, Vec3f* points,
                 Vec3f* normals, float* fractions = nullptr);

/// Writes the triangles of the rows of cells [row_begin, row_end) to their positions in the whole output.
/// Cells are ordered by (z, y, x).
void emit_triangles(const EmitInput& input, std::size_t row_begin, std::size_t row_end, Triangle* triangles);

}  // namespace marrow::internal
