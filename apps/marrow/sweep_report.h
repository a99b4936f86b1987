/// The measures of a sweep over isovalues as a table and as a drawing.
#pragma once

#include <string>
#include <vector>

#include <marrow/isovalue_sweep.h>

#include "drawing.h"

namespace marrow::apps {

/// Comma-separated values: one line a sample, with the number of the plateau that it belongs to.
std::string sweep_csv(const std::vector<SweepSample>& sweep, const std::vector<Plateau>& plateaus);

/// A drawing: volume, area, components and triangles over the isovalue, with the plateaus shaded.
Drawing sweep_drawing(const std::vector<SweepSample>& sweep, const std::vector<Plateau>& plateaus);

}  // namespace marrow::apps
