/// How far the surface of a phantom is from its true surface.
#pragma once

#include <string>
#include <vector>

#include "phantoms.h"

namespace marrow::bench {

/// The signed distance of the points of a surface from the true one, mm; positive outside.
struct SurfaceError {
    double mean = 0, deviation = 0;
    double percentile_95 = 0;  ///< of its magnitude
    bool is_there = false;     ///< there is a surface at all
};

/// The error of the surface of a shape within a cube of `size` mm, away from the border of the scan.
SurfaceError surface_error(const Shape& shape, double size, double isovalue, const Scanner& scanner);

/// The thickness that a plate of `thickness` mm shows, mm; 0: none. It is large and oblique.
double shown_thickness(double thickness, double blur, double isovalue, const Scanner& scanner);

}  // namespace marrow::bench
