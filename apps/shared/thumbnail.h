/// Draws small pictures of scans.
#pragma once

#include <cstdint>
#include <vector>

#include <marrow/volume.h>

namespace marrow::apps {

/// A grey picture with square pixels.
struct Thumbnail {
    int width = 0, height = 0;
    std::vector<std::uint8_t> grey;  ///< row by row from the top
};

/// Draws the middle slice across the third index axis, with `pixels` along the longer side. It lies as
/// radiologists show it: the patient's left or posterior to the right; down is posterior in axial slices,
/// else inferior. Grey runs from the 1st to the 99th percentile of the slice, whatever its samples stand for;
/// those that are not finite are black. `direction` is that of the scan's geometry, or known from elsewhere.
Thumbnail draw_thumbnail(const Volume& scan, const Mat3d& direction, int pixels);

}  // namespace marrow::apps
