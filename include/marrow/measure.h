/// Numbers about meshes.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <marrow/export.h>
#include <marrow/mesh.h>

namespace marrow {

/// What `measure` finds. Lengths are in the mesh's unit (mm).
struct MeshMeasures {
    std::int64_t points = 0;
    std::int64_t triangles = 0;
    std::int64_t components = 0;      ///< sets of triangles connected through shared points
    std::int64_t boundary_edges = 0;  ///< edges with one triangle; 0: closed
    std::int64_t nonmanifold_edges =
        0;  ///< edges with more than two triangles, or two that disagree in orientation
    std::int64_t euler_characteristic = 0;  ///< points - edges + triangles
    double area = 0;                        ///< mm^2
    double volume = 0;     ///< mm^3 enclosed, by the divergence theorem; means little with boundary edges
    Vec3f lower{0, 0, 0};  ///< bounding box
    Vec3f upper{0, 0, 0};
};

/// Measures a mesh in near-linear time. \throw InputError where a triangle names a point that is not there.
MARROW_EXPORT MeshMeasures measure(const Mesh& mesh);

/// How well shaped the triangles of a mesh are.
struct TriangleQuality {
    double smallest_angle = 0;  ///< degrees; 0 where a triangle has no area, and without triangles
    /// All angles, three a triangle, in bins of 10 degrees; the last one includes 180.
    std::array<std::int64_t, 18> angle_histogram{};
    /// Aspect ratio: the longest edge over the inscribed circle's radius, 1 for an equilateral triangle.
    double median_aspect_ratio = 0;
    double largest_aspect_ratio = 0;  ///< infinite where a triangle has no area
    std::int64_t triangles_without_area = 0;
};

/// Measures the shape of every triangle. \throw InputError where a triangle names a point that is not there.
MARROW_EXPORT TriangleQuality triangle_quality(const Mesh& mesh);

/// The mean curvature (k1 + k2) / 2 at each point, in 1/mm, positive where the surface bulges out: 1/r on a
/// sphere of radius r. NaN at points on the mesh's border or on no closed fan of triangles.
///
/// H = grad(area) . n / (2 A), with the gradient of the area of the triangles round the point by the point,
/// their area-weighted normal n, and their mixed Voronoi area A, after Meyer, Desbrun, Schroeder and Barr
/// 2003. \throw InputError as triangle_quality.
MARROW_EXPORT std::vector<double> mean_curvature(const Mesh& mesh);

/// How rough a surface is; all over the points that have a curvature, weighted by area.
struct Roughness {
    double roughness = 0;       ///< 1/mm: the mean of |H - H_window|
    double mean_curvature = 0;  ///< 1/mm: the mean of |H|
    std::int64_t points = 0;    ///< that have a curvature
};

/// How much the mean curvature H of a point differs from H_window, its mean over the point's local window:
/// the points that are reached along edges without going further from it than `window` mm. A plane and a
/// sphere have roughness 0, however dense their mesh; noise and steps raise it.
///
/// After Visutsak 2020 (its reference 19: curvature against the mean over a local window) and Lavoue 2009,
/// but weighted by area instead of by point, so that meshes of different density compare. \throw InputError
/// as triangle_quality; a window that is not positive.
MARROW_EXPORT Roughness roughness(const Mesh& mesh, double window);

/// How far two surfaces lie apart, in mm.
struct MeshDistance {
    double mean = 0;  ///< of the two directions' means over area
    double max = 0;   ///< of both directions: the Hausdorff distance, as far as samples show it
};

/// The symmetric distance of two surfaces: from `samples` places on each, evenly spread over its area, to the
/// nearest place on the other; for the maximum, from its points too. The places depend on the mesh alone, so
/// the result has the same bits every time. \throw InputError an empty mesh, `samples` < 1, or as
/// triangle_quality.
MARROW_EXPORT MeshDistance mesh_distance(const Mesh& a, const Mesh& b, std::int64_t samples = 200'000);

}  // namespace marrow
