// Measures the error of surfaces against the shapes that were scanned.
#include "errors.h"

#include <algorithm>
#include <cmath>

#include <marrow/isosurface.h>

namespace marrow::bench {

SurfaceError surface_error(const Shape& shape, double size, double isovalue, const Scanner& scanner) {
    const Volume volume = scan(shape.blurred, size, scanner);
    const Mesh mesh = extract_isosurface(volume, isovalue, {.topology = true});
    const double border = size / 2 - 3;
    std::vector<double> distances;
    for (const Vec3f& point : mesh.points) {
        const Vec3d p = to_double(point);
        const bool is_inner = std::max({std::abs(p[0]), std::abs(p[1]), std::abs(p[2])}) < border;
        if (is_inner) distances.push_back(shape.distance(p));
    }
    SurfaceError error;
    if (distances.empty()) return error;
    error.is_there = true;
    for (const double d : distances) error.mean += d / static_cast<double>(distances.size());
    for (const double d : distances)
        error.deviation += (d - error.mean) * (d - error.mean) / static_cast<double>(distances.size());
    error.deviation = std::sqrt(error.deviation);
    for (double& d : distances) d = std::abs(d);
    std::sort(distances.begin(), distances.end());
    error.percentile_95 = distances[distances.size() * 95 / 100];
    return error;
}

double shown_thickness(double thickness, double blur, double isovalue, const Scanner& scanner) {
    const double large = 100, reach = 5, step = 0.01;
    const Vec3d normal = (1 / std::sqrt(1.25)) * Vec3d{0.4, -0.3, 1};
    const Mat3d axes{Vec3d{0, 0, normal[0]}, Vec3d{0, 0, normal[1]}, Vec3d{0, 0, normal[2]}};
    // Endless, so that only the axis across the plate matters.
    const Coverage plate = [box = blurred_box({0, 0, 0}, axes, {large, large, thickness / 2}, blur)](
                               const Vec3d& p) { return box(p); };
    const Volume volume = scan(plate, 24, scanner);
    const Vec3d first = (1 / std::hypot(normal[2], normal[0])) * Vec3d{normal[2], 0, -normal[0]};
    const Vec3d second = cross(normal, first);
    double sum = 0;
    int lines = 0;
    for (double u = -4; u <= 4; u += 0.37) {
        for (double v = -4; v <= 4; v += 0.41, ++lines) {
            for (double w = -reach; w <= reach; w += step)
                sum += interpolate(volume, u * first + v * second + w * normal) >= isovalue ? step : 0;
        }
    }
    return sum / lines;
}

}  // namespace marrow::bench
