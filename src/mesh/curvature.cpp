// Computes the mean curvature at points, and roughness from its variation within windows.

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <marrow/error.h>
#include <marrow/measure.h>

#include "base/for_each_range.h"
#include "base/parallel.h"
#include "mesh/connectivity/check_mesh.h"
#include "mesh/connectivity/vertex_triangles.h"
#include "mesh/geometry/triangle_corners.h"

namespace marrow {

using namespace internal;

namespace {

// The share of corner p in its triangle: its Voronoi region, or half or a quarter of an obtuse triangle.
double mixed_area(const Vec3d& p, const Vec3d& q, const Vec3d& r, double area) {
    const double at_p = dot(q - p, r - p), at_q = dot(r - q, p - q), at_r = dot(p - r, q - r);
    if (at_p < 0) return area / 2;
    if (at_q < 0 || at_r < 0) return area / 4;
    const double cot_q = at_q / (2 * area), cot_r = at_r / (2 * area);
    return (dot(r - p, r - p) * cot_q + dot(q - p, q - p) * cot_r) / 8;
}

struct PointCurvature {
    double curvature = std::numeric_limits<double>::quiet_NaN();  // 1/mm
    double area = 0;                                              // mm^2; 0 if there is no curvature
};

PointCurvature curvature_at(const MeshView& mesh, const Triangle* begin, const Triangle* end) {
    if (!is_closed_fan(begin, end)) return {};
    Vec3d gradient{0, 0, 0}, normal{0, 0, 0};
    double area = 0;
    for (const Triangle* t = begin; t != end; ++t) {
        const TriangleCorners corners = corners_of(mesh, *t);
        const Vec3d n = scaled_normal(corners);
        const double twice_area = length(n);
        if (!(twice_area > 0)) continue;
        // Half the opposite edge, rotated in the plane of the triangle. It is finite for thin triangles too.
        gradient = gradient + (0.5 / twice_area) * cross(n, corners[2] - corners[1]);
        normal = normal + n;
        area += mixed_area(corners[0], corners[1], corners[2], twice_area / 2);
    }
    const double weight = length(normal);
    if (!(area > 0) || !(weight > 0)) return {};
    return {dot(gradient, normal) / (weight * 2 * area), area};
}

constexpr std::size_t kPointsPerRange = 1024;

std::vector<PointCurvature> curvatures(const MeshView& mesh, const VertexTriangles& vertex_triangles,
                                       const Progress& progress, double begin, double end) {
    std::vector<PointCurvature> result(mesh.points.size());
    for_each_range(result.size(), kPointsPerRange, progress, begin, end,
                   [&](std::size_t first, std::size_t last) {
                       for (std::size_t p = first; p < last; ++p)
                           result[p] = curvature_at(mesh, vertex_triangles.begin(p), vertex_triangles.end(p));
                   });
    return result;
}

// Averages the mean curvature over the windows of points. Each thread needs its own.
class WindowMean {
  public:
    WindowMean(const MeshView& mesh, const VertexTriangles& vertex_triangles,
               const std::vector<PointCurvature>& points, double radius)
        : mesh_(mesh),
          vertex_triangles_(vertex_triangles),
          points_(points),
          radius_(radius),
          reached_from_(mesh.points.size(), kNone) {}

    double operator()(std::uint32_t centre) {
        const Vec3d position = to_double(mesh_.points[centre]);
        double sum = 0, area = 0;
        window_.assign(1, centre);
        reached_from_[centre] = centre;
        for (std::size_t i = 0; i < window_.size(); ++i) {
            const std::uint32_t p = window_[i];
            sum += points_[p].area * points_[p].curvature;
            area += points_[p].area;
            for (const Triangle* t = vertex_triangles_.begin(p); t != vertex_triangles_.end(p); ++t) {
                const std::uint32_t next = (*t)[1];  // in a closed fan, this visits every neighbour once
                if (reached_from_[next] == centre || points_[next].area == 0) continue;
                reached_from_[next] = centre;
                if (length(to_double(mesh_.points[next]) - position) <= radius_) window_.push_back(next);
            }
        }
        return sum / area;
    }

  private:
    static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

    const MeshView mesh_;
    const VertexTriangles& vertex_triangles_;
    const std::vector<PointCurvature>& points_;
    const double radius_;
    std::vector<std::uint32_t> reached_from_;  // of each point: the last centre whose search reached it
    std::vector<std::uint32_t> window_;        // kept for its memory
};

// Serial, so that the sums have the same bits for any number of threads.
Roughness average(const std::vector<PointCurvature>& points, const std::vector<double>& deviation) {
    Roughness result;
    double area = 0;
    for (std::size_t p = 0; p < points.size(); ++p) {
        if (points[p].area == 0) continue;
        ++result.points;
        area += points[p].area;
        result.roughness += points[p].area * deviation[p];
        result.mean_curvature += points[p].area * std::abs(points[p].curvature);
    }
    if (area > 0) {
        result.roughness /= area;
        result.mean_curvature /= area;
    }
    return result;
}

}  // namespace

std::vector<double> mean_curvature(MeshView mesh, const CurvatureOptions& options) {
    check_arrays(mesh);
    std::vector<PointCurvature> points;
    with_threads(options.threads,
                 [&] { points = curvatures(mesh, VertexTriangles(mesh), options.progress, 0, 1); });
    std::vector<double> result(points.size());
    std::transform(points.begin(), points.end(), result.begin(),
                   [](const PointCurvature& p) { return p.curvature; });
    return result;
}

Roughness roughness(MeshView mesh, double window, const CurvatureOptions& options) {
    if (!(window > 0)) throw InputError("roughness: the window must be a positive number of mm");
    check_arrays(mesh);
    const VertexTriangles vertex_triangles(mesh);
    std::vector<PointCurvature> points;
    std::vector<double> deviation(mesh.points.size(), 0);
    with_threads(options.threads, [&] {
        points = curvatures(mesh, vertex_triangles, options.progress, 0, 0.2);
        PerThread<WindowMean> means([&] { return WindowMean(mesh, vertex_triangles, points, window); });
        for_each_range(points.size(), kPointsPerRange, options.progress, 0.2, 1,
                       [&](std::size_t first, std::size_t last) {
                           WindowMean& mean = means.local();
                           for (std::size_t p = first; p < last; ++p) {
                               if (points[p].area > 0)
                                   deviation[p] =
                                       std::abs(points[p].curvature - mean(static_cast<std::uint32_t>(p)));
                           }
                       });
    });
    return average(points, deviation);
}

}  // namespace marrow
