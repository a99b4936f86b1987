/// Restricts a surface to the cells of a mask.
#pragma once

#include <marrow/buffer.h>
#include <marrow/histo_pyramid.h>
#include <marrow/mesh.h>
#include <marrow/volume.h>

#include "core/marching_cubes/inside_bits.h"

namespace marrow::internal {

/// Keeps the triangles of the cells whose eight samples are not 0 in `mask`, and the points of these
/// triangles with their normals and, unless null, values. \pre `mesh` is as emitted, without snapping, from
/// `bits`, which are not those of a closed surface; `triangles` are the counts of its rows
void keep_masked_cells(const VolumeView& mask, const InsideBits& bits, const ActiveWords& active,
                       const HistoPyramid& triangles, Mesh& mesh, Buffer<float>* values);

}  // namespace marrow::internal
