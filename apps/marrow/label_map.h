/// Tells label maps from scans.
#pragma once

#include <marrow/volume.h>

namespace marrow::cli {

/// Whether the samples are probably labels rather than measurements: whole numbers from 0, of which most that
/// are not background equal their neighbour.
bool looks_like_label_map(const Volume& volume);

}  // namespace marrow::cli
