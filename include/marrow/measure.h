/// Measures meshes: size, topology, triangle shape, curvature, roughness and distance.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <marrow/export.h>
#include <marrow/mesh.h>
#include <marrow/progress.h>

namespace marrow {

/// The result of measure(). Lengths are in the unit of the mesh (mm).
struct MeshMeasures {
    std::int64_t points = 0;
    std::int64_t triangles = 0;
    std::int64_t components = 0;      ///< sets of triangles that are connected through shared points
    std::int64_t cavities = 0;        ///< components that are closed and face inward
    std::int64_t boundary_edges = 0;  ///< edges with one triangle; a closed mesh has none
    /// Edges with more than two triangles, or with two triangles that are oriented differently.
    std::int64_t nonmanifold_edges = 0;
    std::int64_t euler_characteristic = 0;  ///< points - edges + triangles
    double area = 0;                        ///< mm^2
    double volume = 0;     ///< mm^3, by the divergence theorem; only meaningful without boundary edges
    Vec3f lower{0, 0, 0};  ///< lower corner of the bounding box
    Vec3f upper{0, 0, 0};  ///< upper corner of the bounding box
};

/// How measure() and area_and_volume() run.
struct MeasureOptions {
    int threads = 0;  ///< 0: all
};

/// Measures a mesh in nearly linear time. The result has the same bits for any number of threads.
/// \throw InputError if a triangle has an index out of range
MARROW_EXPORT MeshMeasures measure(MeshView mesh, const MeasureOptions& options = {});

/// The result of area_and_volume().
struct AreaAndVolume {
    double area = 0;    ///< mm^2
    double volume = 0;  ///< mm^3; only meaningful without boundary edges
};

/// Measures only the area and the volume of a mesh, with the same bits as measure(), in a fraction of its
/// time. \throw InputError if a triangle has an index out of range
MARROW_EXPORT AreaAndVolume area_and_volume(MeshView mesh, const MeasureOptions& options = {});

/// The result of triangle_quality().
struct TriangleQuality {
    double smallest_angle = 0;  ///< degrees; 0 if a triangle has no area or if there are no triangles
    /// All angles, three per triangle, in bins of 10 degrees. The last bin includes 180 degrees.
    std::array<std::int64_t, 18> angle_histogram{};
    /// The aspect ratio: the longest edge over the inscribed radius, scaled to 1 for an equilateral triangle.
    double median_aspect_ratio = 0;
    double largest_aspect_ratio = 0;  ///< infinite if a triangle has no area
    std::int64_t triangles_without_area = 0;
};

/// Measures the shape of every triangle. \throw InputError if a triangle has an index out of range, or if a
/// coordinate is not finite
MARROW_EXPORT TriangleQuality triangle_quality(MeshView mesh);

/// How mean_curvature and roughness run.
struct CurvatureOptions {
    int threads = 0;  ///< 0: all
    Progress progress = {};
};

/// Returns the mean curvature (k1 + k2) / 2 at each point in 1/mm. It is positive where the surface bulges
/// outward: 1/r on a sphere of radius r. It is NaN at points whose triangles do not form one closed fan, for
/// example on the border of the mesh.
///
/// H = grad(area) . n / (2 A). grad(area) is the gradient, by the point, of the area of the triangles around
/// it. n is their area-weighted normal. A is the mixed Voronoi area of the point. After Meyer, Desbrun,
/// Schroeder and Barr 2003.
///
/// \throw InputError if a triangle has an index out of range
/// \throw Cancelled if the progress callback returns false
MARROW_EXPORT std::vector<double> mean_curvature(MeshView mesh, const CurvatureOptions& options = {});

/// The result of roughness(). Means are weighted by area, over all points that have a curvature.
struct Roughness {
    double roughness = 0;       ///< 1/mm: the mean of |H - H_window|
    double mean_curvature = 0;  ///< 1/mm: the mean of |H|
    std::int64_t points = 0;    ///< the number of points that have a curvature
};

/// Measures how much the mean curvature H of a point differs from H_window, the mean of H over its window.
///
/// The window of a point consists of the points that can be reached from it along edges without leaving the
/// ball of radius `window` mm around it. Planes and spheres have roughness 0, however dense their mesh is.
/// Noise and steps increase it. After Visutsak 2020 (its reference 19 compares curvature with the mean over a
/// local window) and Lavoue 2009, but weighted by area instead of by point, so that meshes of different
/// density can be compared.
///
/// The result has the same bits for any number of threads.
/// \throw InputError if a triangle has an index out of range or if `window` is not positive
/// \throw Cancelled if the progress callback returns false
MARROW_EXPORT Roughness roughness(MeshView mesh, double window, const CurvatureOptions& options = {});

/// The distance between two surfaces in mm.
struct MeshDistance {
    double mean = 0;  ///< the mean distance over the area, averaged over both directions
    double max = 0;   ///< the Hausdorff distance, as far as the samples show it
};

struct DistanceOptions {
    std::int64_t samples = 200'000;  ///< surface samples on each mesh, spread evenly over its area
    int threads = 0;                 ///< 0: all
    Progress progress = {};
};

/// Measures the symmetric distance between two surfaces, from samples on each to the nearest point of the
/// other. The points of the triangles are samples for the maximum too.
///
/// The samples depend only on the meshes, and the result has the same bits for any number of threads.
/// \throw InputError if a mesh has no triangles, if a triangle has an index out of range, if a coordinate is
/// not finite, or if `samples` < 1
/// \throw LimitError if a mesh has 2^32 triangles or more, or if the samples do not fit into memory
/// \throw Cancelled if the progress callback returns false
MARROW_EXPORT MeshDistance mesh_distance(MeshView a, MeshView b, const DistanceOptions& options = {});

}  // namespace marrow
