// `marrow MAP --labels`: a surface for each label of a map.
#pragma once

#include "run.h"
#include "voice.h"

namespace marrow {

/// Extracts, writes, draws and reports the surfaces of all labels. \throw EmptySurface nothing but background
void extract_label_map(const Settings& settings, const Console& console, Voice& voice);

}  // namespace marrow
