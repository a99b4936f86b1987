/// Phantoms of known size as a scanner would show them: blurred by a Gaussian, averaged over the thickness of
/// a slice, and noisy. The blur is exact: each shape has a formula.
#pragma once

#include <cstdint>
#include <functional>

#include <marrow/volume.h>

namespace marrow::bench {

/// How much of a position is inside a blurred shape, from 0 to 1; mm.
using Coverage = std::function<double(const Vec3d&)>;

/// A shape and its true surface.
struct Shape {
    Coverage blurred;
    std::function<double(const Vec3d&)> distance;  ///< signed, mm; positive outside
};

/// The blur `sigma` is the standard deviation in mm.
Shape blurred_ball(const Vec3d& centre, double radius, double sigma);
/// An endless tube.
Shape blurred_tube(const Vec3d& centre, const Vec3d& direction, double radius, double sigma);
/// A box with `half` its sizes along the columns of a rotation.
Coverage blurred_box(const Vec3d& centre, const Mat3d& axes, const Vec3d& half, double sigma);

/// What a scanner does to a shape.
struct Scanner {
    double spacing = 0.5;   ///< mm, within slices
    double slice = 0.5;     ///< mm: thickness of slices, and their distance
    double background = 0;  ///< HU around the shape
    double material = 0;    ///< HU of the shape
    double noise = 0;       ///< HU
    std::uint64_t seed = 1;
};

/// A scan of a cube of `size` mm around the origin; int16, as CT.
Volume scan(const Coverage& coverage, double size, const Scanner& scanner);

/// The trilinear interpolant of a scan at a position within it. \pre its direction is
/// the identity, its samples int16
double interpolate(const Volume& scan, const Vec3d& position);

}  // namespace marrow::bench
