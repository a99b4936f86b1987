/// Tells label maps from scans.
#pragma once

#include <cstdint>

#include <marrow/scan_io.h>
#include <marrow/volume.h>

namespace marrow::apps {

/// Whether a volume is a label map: the headers say so, or they do not say what it is and its samples are
/// probably labels rather than measurements: whole numbers from 0, and most neighbours that are both not
/// background are equal.
bool is_label_map(const Volume& volume, const SeriesInfo& series);

/// Whether most neighbours along x that are both not `background` are equal. Noise makes those of a scan
/// differ, while those within a structure of a label map are equal. \pre `background` fits the type of the
/// samples
bool has_equal_neighbours(const Volume& volume, std::int64_t background);

}  // namespace marrow::apps
