/// Tells label maps from scans.
#pragma once

#include <marrow/volume.h>

namespace marrow::apps {

/// Whether the samples are probably labels rather than measurements: whole numbers from 0, and most
/// neighbours that are both not background are equal.
bool looks_like_label_map(const Volume& volume);

}  // namespace marrow::apps
