/// Smooths a label map's surface net.
#pragma once

#include "surface_net.h"

namespace marrow::internal {

/// Fills in net.points: moves each point towards or away from the mean of its neighbours, `passes` times.
/// Points stay in their cells. Does nothing for 0 passes.
void relax(SurfaceNet& net, int passes, const Progress& progress);

}  // namespace marrow::internal
