/// Keeps the surfaces of relaxed labels from passing through themselves and each other.
#pragma once

#include <cstddef>
#include <functional>

#include <marrow/buffer.h>
#include <marrow/mesh.h>
#include <marrow/progress.h>

#include "label_meshes.h"

namespace marrow::internal {

/// Where the net would pass through itself or be folded, points go back towards where they were before
/// relaxation, in the meshes of all labels that share them, and are counted. The net has `points` points.
/// `before_relaxation` returns their positions then; it is called at most once, with the progress that it
/// reports to. \throw Cancelled
void hold_back_labels(LabelMeshes& labels, std::size_t points,
                      const std::function<Buffer<Vec3f>(const Progress&)>& before_relaxation,
                      const Progress& progress);

}  // namespace marrow::internal
