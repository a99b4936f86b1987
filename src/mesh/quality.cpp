// Measures the angles and aspect ratios of triangles.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <marrow/measure.h>

#include "mesh/connectivity/check_mesh.h"
#include "mesh/geometry/triangle_corners.h"

namespace marrow {

using namespace internal;

namespace {

// The angle at p in degrees; 0 or 180 if the corners are collinear.
double angle_at(const Vec3d& p, const Vec3d& q, const Vec3d& r) {
    const Vec3d u = q - p, v = r - p;
    return std::atan2(length(cross(u, v)), dot(u, v)) * 180 / std::numbers::pi;
}

double aspect_ratio(const TriangleCorners& t) {
    const double edges[3] = {length(t[1] - t[0]), length(t[2] - t[1]), length(t[0] - t[2])};
    const double inscribed_radius = 2 * area(t) / (edges[0] + edges[1] + edges[2]);
    const double equilateral = 2 * std::numbers::sqrt3;
    return std::max({edges[0], edges[1], edges[2]}) / (equilateral * inscribed_radius);
}

}  // namespace

TriangleQuality triangle_quality(MeshView mesh) {
    check_arrays(mesh);
    check_coordinates(mesh.points);
    TriangleQuality quality;
    if (mesh.triangles.empty()) return quality;
    quality.smallest_angle = 180;
    std::vector<double> ratios;
    ratios.reserve(mesh.triangles.size());
    for (const Triangle& triangle : mesh.triangles) {
        const TriangleCorners t = corners_of(mesh, triangle);
        for (const double angle :
             {angle_at(t[0], t[1], t[2]), angle_at(t[1], t[2], t[0]), angle_at(t[2], t[0], t[1])}) {
            quality.smallest_angle = std::min(quality.smallest_angle, angle);
            ++quality.angle_histogram[std::min<std::size_t>(static_cast<std::size_t>(angle / 10), 17)];
        }
        const bool has_area = area(t) > 0;
        quality.triangles_without_area += !has_area;
        ratios.push_back(has_area ? aspect_ratio(t) : std::numeric_limits<double>::infinity());
    }
    const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
    std::nth_element(ratios.begin(), middle, ratios.end());
    quality.median_aspect_ratio =
        ratios.size() % 2 != 0 ? *middle : (*middle + *std::max_element(ratios.begin(), middle)) / 2;
    quality.largest_aspect_ratio = *std::max_element(middle, ratios.end());
    return quality;
}

}  // namespace marrow
