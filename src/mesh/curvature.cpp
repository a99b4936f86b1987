// Mean curvature at points, and roughness: how it varies within a local window.
#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>

#include <marrow/error.h>
#include <marrow/measure.h>

#include "check_indices.h"
#include "vertex_triangles.h"
#include "vector.h"

namespace marrow {

using namespace internal;

namespace {

// Whether the triangles round a point leave no gap: every neighbour is entered once and left once.
bool is_closed(const Triangle* begin, const Triangle* end) {
    std::vector<std::uint32_t> entered, left;
    for (const Triangle* t = begin; t != end; ++t) {
        left.push_back((*t)[1]);
        entered.push_back((*t)[2]);
    }
    std::sort(left.begin(), left.end());
    std::sort(entered.begin(), entered.end());
    return begin != end && left == entered && std::adjacent_find(left.begin(), left.end()) == left.end();
}

// A corner's part of its triangle: the Voronoi region where the triangle is not obtuse, else half or a
// quarter.
double mixed_area(const Vec3d& p, const Vec3d& q, const Vec3d& r, double area) {
    const double at_p = dot(q - p, r - p), at_q = dot(r - q, p - q), at_r = dot(p - r, q - r);
    if (at_p < 0) return area / 2;
    if (at_q < 0 || at_r < 0) return area / 4;
    const double cot_q = at_q / (2 * area), cot_r = at_r / (2 * area);
    return (dot(r - p, r - p) * cot_q + dot(q - p, q - p) * cot_r) / 8;
}

struct PointCurvature {
    double curvature = std::numeric_limits<double>::quiet_NaN();  // 1/mm
    double area = 0;                                              // mm^2; 0 where there is no curvature
};

PointCurvature curvature_at(const Mesh& mesh, const Triangle* begin, const Triangle* end) {
    if (!is_closed(begin, end)) return {};
    Vec3d gradient{0, 0, 0}, normal{0, 0, 0};
    double area = 0;
    for (const Triangle* t = begin; t != end; ++t) {
        const Corners corners(mesh, *t);
        const Vec3d n = cross(corners.b - corners.a, corners.c - corners.a);
        const double twice_area = length(n);
        if (!(twice_area > 0)) continue;
        // Half the opposite edge, turned in the triangle's plane: finite however thin the triangle.
        gradient = gradient + (0.5 / twice_area) * cross(n, corners.c - corners.b);
        normal = normal + n;
        area += mixed_area(corners.a, corners.b, corners.c, twice_area / 2);
    }
    const double weight = length(normal);
    if (!(area > 0) || !(weight > 0)) return {};
    return {dot(gradient, normal) / (weight * 2 * area), area};
}

std::vector<PointCurvature> curvatures(const Mesh& mesh, const Fans& fans) {
    std::vector<PointCurvature> result(mesh.points.size());
    tbb::parallel_for(std::size_t{0}, result.size(),
                      [&](std::size_t p) { result[p] = curvature_at(mesh, fans.begin(p), fans.end(p)); });
    return result;
}

// The mean curvature of the points that are reached from one without leaving its window.
class Window {
  public:
    Window(const Mesh& mesh, const Fans& fans, const std::vector<PointCurvature>& points, double radius)
        : mesh_(mesh), fans_(fans), points_(points), radius_(radius), seen_(mesh.points.size(), kNone) {}

    double mean_round(std::uint32_t centre) {
        const Vec3d middle = to_double(mesh_.points[centre]);
        double sum = 0, area = 0;
        reached_.assign(1, centre);
        seen_[centre] = centre;
        for (std::size_t i = 0; i < reached_.size(); ++i) {
            const std::uint32_t p = reached_[i];
            sum += points_[p].area * points_[p].curvature;
            area += points_[p].area;
            for (const Triangle* t = fans_.begin(p); t != fans_.end(p); ++t) {
                const std::uint32_t next = (*t)[1];  // of a closed fan, every neighbour once
                if (seen_[next] == centre || points_[next].area == 0) continue;
                seen_[next] = centre;
                if (length(to_double(mesh_.points[next]) - middle) <= radius_) reached_.push_back(next);
            }
        }
        return sum / area;
    }

  private:
    static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

    const Mesh& mesh_;
    const Fans& fans_;
    const std::vector<PointCurvature>& points_;
    const double radius_;
    std::vector<std::uint32_t> seen_;  // the last centre that came by
    std::vector<std::uint32_t> reached_;
};

}  // namespace

std::vector<double> mean_curvature(const Mesh& mesh) {
    check_triangles(mesh);
    const std::vector<PointCurvature> points = curvatures(mesh, Fans(mesh));
    std::vector<double> result(points.size());
    std::transform(points.begin(), points.end(), result.begin(),
                   [](const PointCurvature& p) { return p.curvature; });
    return result;
}

Roughness roughness(const Mesh& mesh, double window) {
    if (!(window > 0)) throw InputError("roughness: the window must be a positive number of mm");
    check_triangles(mesh);
    const Fans fans(mesh);
    const std::vector<PointCurvature> points = curvatures(mesh, fans);

    std::vector<double> deviation(points.size(), 0);
    tbb::enumerable_thread_specific<Window> windows([&] { return Window(mesh, fans, points, window); });
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, points.size(), 4096), [&](const auto& range) {
        Window& local = windows.local();
        for (std::size_t p = range.begin(); p < range.end(); ++p) {
            if (points[p].area > 0)
                deviation[p] =
                    std::abs(points[p].curvature - local.mean_round(static_cast<std::uint32_t>(p)));
        }
    });

    Roughness result;
    double area = 0;
    for (std::size_t p = 0; p < points.size(); ++p) {  // one after another, so that the sum has the same bits
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

}  // namespace marrow
