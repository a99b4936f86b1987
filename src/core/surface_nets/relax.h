/// Relaxation of a label map's surface net against stairs.
#pragma once

#include "surface_net.h"

namespace marrow::internal {

/// Moves points towards those they are joined with, `passes` times.
void relax(LabelNet& net, int passes, const Progress& progress);

}  // namespace marrow::internal
