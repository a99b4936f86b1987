// `marrow sweep`: the measures of many isovalues as a table and a drawing.
#pragma once

#include "run.h"
#include "voice.h"

namespace marrow {

/// Measures, writes and prints. \throw EmptySurface no isovalues between the two ends
void sweep(const Settings& settings, const Console& console, Voice& voice);

}  // namespace marrow
