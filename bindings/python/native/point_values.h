/// The values of points, as scikit-image's marching_cubes returns them.
#pragma once

#include <cstddef>

#include <marrow/mesh.h>
#include <marrow/volume.h>

#include "index_mapping.h"

namespace marrow::python {

/// Finds the value of each point: of the four cells around its edge, the largest range of a cell's
/// samples. Points that snapping has moved off the edges, and those within a cell, have the value of a
/// nearby edge. NaN does not count.
void find_point_values(const VolumeView& volume, const IndexMapping& mapping, const Vec3f* points,
                       std::size_t count, float* values);

}  // namespace marrow::python
