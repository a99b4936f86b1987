/// Divides the slices of a DICOM series into volumes: time points, echoes, diffusion weights and the like.
#pragma once

#include <vector>

#include "stack.h"

namespace marrow::internal::io {

/// Divides a sorted stack in which several slices have the same position, by the attributes that tell these
/// slices apart. Returns the stack itself if no attribute does, or if no positions coincide.
///
/// Values divide the slices if they differ at a position, and if each value has slices at half of the
/// positions or more. Times that differ from position to position, and numbers of instances, divide them by
/// their order, if all positions have the same number of slices.
std::vector<DicomStack> divide_into_volumes(DicomStack stack);

}  // namespace marrow::internal::io
