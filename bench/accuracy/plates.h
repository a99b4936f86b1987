/// A plate across the opening of a thick frame: how much of it the surface shows, the alarm finds, and
/// --keep-thin restores.
#pragma once

#include <marrow/volume.h>

#include "phantoms.h"

namespace marrow::bench {

inline constexpr double kPlateSide = 16;  ///< mm: the opening of the frame

/// What was found of a plate.
struct PlateResult {
    double shown = 0;               ///< part of the plate that is in the surface
    double thickness = 0;           ///< mm: the mean where it is shown
    double alarm = 0;               ///< mm^2
    double restored = 0;            ///< part of the plate that is in the surface with --keep-thin
    double restored_thickness = 0;  ///< mm
    double restored_volume = 0;     ///< mm^3 that --keep-thin adds to the surface
    bool sound = false;             ///< the restored surface is closed, manifold and not crossing itself
};

/// A plate of `thickness` mm, 0: none, oblique in the grid; `sigma` is the blur, mm.
PlateResult examine_plate(double thickness, double sigma, double isovalue, const Scanner& scanner);

}  // namespace marrow::bench
