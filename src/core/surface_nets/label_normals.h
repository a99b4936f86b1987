/// The normals of the surfaces of labels.
#pragma once

#include <vector>

#include <marrow/labels.h>
#include <marrow/progress.h>

namespace marrow::internal {

/// Gives the points of surfaces unit normals: the sum of the normals of the triangles
/// around each, weighted by area.
void add_label_normals(std::vector<LabelSurface>& surfaces, const Progress& progress);

}  // namespace marrow::internal
