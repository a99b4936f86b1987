// The shape of triangles.
#include <algorithm>
#include <limits>
#include <numbers>

#include <marrow/measure.h>

#include "check_indices.h"
#include "vector.h"

namespace marrow {

using namespace internal;

namespace {

// The angle at p, in degrees; 0 or 180 where the corners lie in a line.
double angle_at(const Vec3d& p, const Vec3d& q, const Vec3d& r) {
    const Vec3d u = q - p, v = r - p;
    return std::atan2(length(cross(u, v)), dot(u, v)) * 180 / std::numbers::pi;
}

double aspect_ratio(const Corners& t) {
    const double edges[3] = {length(t.b - t.a), length(t.c - t.b), length(t.a - t.c)};
    const double inscribed_radius = 2 * t.area() / (edges[0] + edges[1] + edges[2]);
    const double equilateral = 2 * std::numbers::sqrt3;
    return std::max({edges[0], edges[1], edges[2]}) / (equilateral * inscribed_radius);
}

}  // namespace

TriangleQuality triangle_quality(const Mesh& mesh) {
    check_triangles(mesh);
    TriangleQuality quality;
    if (mesh.triangles.empty()) return quality;
    quality.smallest_angle = 180;
    std::vector<double> ratios;
    ratios.reserve(mesh.triangles.size());
    for (const Triangle& triangle : mesh.triangles) {
        const Corners t(mesh, triangle);
        for (const double angle :
             {angle_at(t.a, t.b, t.c), angle_at(t.b, t.c, t.a), angle_at(t.c, t.a, t.b)}) {
            quality.smallest_angle = std::min(quality.smallest_angle, angle);
            ++quality.angle_histogram[std::min<std::size_t>(static_cast<std::size_t>(angle / 10), 17)];
        }
        const bool has_area = t.area() > 0;
        quality.triangles_without_area += !has_area;
        ratios.push_back(has_area ? aspect_ratio(t) : std::numeric_limits<double>::infinity());
    }
    const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
    std::nth_element(ratios.begin(), middle, ratios.end());
    quality.median_aspect_ratio = *middle;
    quality.largest_aspect_ratio = *std::max_element(middle, ratios.end());
    return quality;
}

}  // namespace marrow
