/// Walls thinner than a scan can carry: where they fall below the isovalue beside a
/// surface, and how to keep them.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <marrow/export.h>
#include <marrow/mesh.h>
#include <marrow/progress.h>
#include <marrow/vector.h>
#include <marrow/volume.h>

namespace marrow {

struct ThinWallOptions {
    /// Standard deviation of the noise, in the unit of the values; >= 0. Not set: estimate_noise() gives it
    std::optional<double> noise = {};
    /// ScanInfo::padding: the value of samples that say nothing of a wall or of the noise
    std::optional<double> padding = {};
    int threads = 0;  ///< 0: all
    Progress progress = {};
};

/// A sample in the middle of a wall that does not clearly reach the isovalue.
struct RidgeSample {
    std::array<std::int64_t, 3> index;  ///< in the view
    std::size_t axis = 0;               ///< the index axis that crosses the wall most steeply
    double area = 0;                    ///< mm^2; the part of the wall that it stands for
};

/// A connected part of a wall.
struct ThinWall {
    Vec3d position{0, 0, 0};  ///< mm, LPS; on the wall, near its middle
    double area = 0;          ///< mm^2
};

/// The result of find_thin_walls().
struct ThinWalls {
    double area = 0;                   ///< mm^2; of all walls
    std::vector<ThinWall> walls;       ///< the largest first
    std::vector<RidgeSample> samples;  ///< ordered by (z, y, x)
};

/// Finds where walls beside an isosurface do not clearly reach the isovalue, because they are thinner than
/// the scan can carry: blur lowers their peak. The surface has a hole there, or ends.
///
/// A sample is in the middle of such a wall if it is a local maximum along the axis that crosses the wall
/// most steeply, and its contrast is right. Let T be the isovalue, and b the higher of the lowest samples
/// within three samples on either side. The contrast over b is at least five times the noise. It is also
/// between 0.5 and 1.1 times T - b, as a wall that barely reaches T has holes between the samples. And the
/// wall is a sheet: no second derivative is positive and more than half as large as the one across, as it is
/// between two bodies that nearly touch. At the rim, the body at which the wall ends raises the samples
/// beside it. So there, and where three samples around are in the sheet, a contrast of 0.4 times T - b is
/// enough, and the sheet need not be flat.
///
/// Walls begin at samples beside the inside of the surface, and go on from sample to neighbouring sample.
/// Those with fewer than five samples in their sheet are left out, and so is what has padding or falls to an
/// infinite sample within three samples across it. A fold of soft tissue between air looks the same as a thin
/// wall of bone, and sharp edges can look like one.
///
/// `surface` is the surface that extract_isosurface gives at `isovalue`. The result is the same for any
/// number of threads. \throw InputError a null view, bad geometry, an isovalue or a coordinate that is not
/// finite, or a noise that is negative or not finite; LimitError not enough memory; Cancelled
MARROW_EXPORT ThinWalls find_thin_walls(const VolumeView& volume, double isovalue, MeshView surface,
                                        const ThinWallOptions& options = {});

/// Returns a copy of the volume in which `walls` reach the isovalue, so that its isosurface includes them.
/// They then begin and end where the samples pass half of the wall's own peak over each side. Their
/// thickness is right where it is above the width of the scan's blur; thinner walls get that width.
/// \pre find_thin_walls() found the walls in this volume
/// \throw InputError a null view, no samples, bad geometry, or an isovalue that is not finite; LimitError not
/// enough memory; Cancelled
MARROW_EXPORT Volume restore_thin_walls(const VolumeView& volume, double isovalue, const ThinWalls& walls,
                                        const Progress& progress = {});

/// Says for each point whether it is within about one sample of `walls`: on their rims, or on restored walls.
/// \pre find_thin_walls() found the walls in this volume
/// \throw InputError a null view or bad geometry
MARROW_EXPORT std::vector<bool> near_thin_walls(const VolumeView& volume, const ThinWalls& walls,
                                                std::span<const Vec3f> points);

}  // namespace marrow
