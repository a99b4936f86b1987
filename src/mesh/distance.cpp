// Spreads samples over each surface and measures their distances to the other surface.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

#include <marrow/error.h>
#include <marrow/measure.h>

#include "base/parallel.h"
#include "check_indices.h"
#include "distance.h"
#include "for_each_range.h"
#include "triangle_corners.h"

namespace marrow {

using namespace internal;

namespace {

// Samples that are spread evenly over a mesh. Equal steps along the summed areas of the triangles choose the
// triangle of sample k. The additive sequence of the plastic number (Roberts 2018) chooses its position in
// the triangle.
struct SpreadSamples {
    std::vector<Distances::SurfaceSample> samples;
    std::vector<std::size_t> first;  // triangle t has samples first[t] to first[t + 1] - 1

    SpreadSamples(const MeshView& mesh, std::int64_t n) : samples(static_cast<std::size_t>(n)) {
        std::vector<double> summed_area;
        summed_area.reserve(mesh.triangles.size());
        double sum = 0;
        for (const Triangle& t : mesh.triangles) summed_area.push_back(sum += area(corners_of(mesh, t)));
        first.reserve(mesh.triangles.size() + 1);
        std::size_t k = 0;
        for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
            first.push_back(k);
            const bool last = t + std::size_t{1} == mesh.triangles.size();
            for (; k < samples.size() &&
                   (last || (static_cast<double>(k) + 0.5) / static_cast<double>(n) * sum < summed_area[t]);
                 ++k)
                samples[k] = {position(corners_of(mesh, mesh.triangles[t]), static_cast<double>(k)), t, 0};
        }
        first.push_back(k);
    }

  private:
    static Vec3d position(const TriangleCorners& t, double k) {
        double u = fraction(0.7548776662466927 * k), v = fraction(0.5698402909980532 * k);
        if (u + v > 1) u = 1 - u, v = 1 - v;
        return t[0] + u * (t[1] - t[0]) + v * (t[2] - t[0]);
    }
    static double fraction(double x) { return x - std::floor(x); }
};

constexpr std::uint32_t kNone = ~std::uint32_t{0};

// Chooses for each point one of its triangles; kNone if it has no triangle.
std::vector<std::uint32_t> last_triangle_of_points(const MeshView& mesh) {
    std::vector<std::uint32_t> triangle(mesh.points.size(), kNone);
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
        for (const std::uint32_t p : mesh.triangles[t]) triangle[p] = t;
    }
    return triangle;
}

}  // namespace

namespace internal {

double Distances::max() const {
    double max = *std::max_element(points.begin(), points.end());
    for (const SurfaceSample& s : samples) max = std::max(max, s.distance);
    return max;
}

double Distances::mean() const {
    const auto add = [](double sum, const SurfaceSample& s) { return sum + s.distance; };
    return std::accumulate(samples.begin(), samples.end(), 0.0, add) / static_cast<double>(samples.size());
}

Distances distances(const MeshView& from, const TriangleTree& from_tree, const TriangleTree& to,
                    const DistanceSearch& search, const Progress& progress, double begin, double end) {
    SpreadSamples spread(from, search.samples);
    const std::vector<std::uint32_t> triangle_of = last_triangle_of_points(from);
    Distances d;
    d.points.resize(from.points.size());
    // A point that is nearer than the furthest point so far does not change the maximum.
    std::atomic<double> furthest = 0;
    const auto measure_point = [&](std::uint32_t p, std::uint32_t& guess) {
        double known = furthest.load(std::memory_order_relaxed);
        const double distance = to.distance(to_double(from.points[p]), std::min(known, search.enough), guess);
        while (distance > known &&
               !furthest.compare_exchange_weak(known, distance, std::memory_order_relaxed)) {
        }
        d.points[p] = distance;
    };
    // Along the curve of the tree, the nearest triangle to one sample is a good guess for the next.
    for_each_range(
        from.triangles.size(), 256, progress, begin, end, [&](std::size_t first, std::size_t last) {
            std::uint32_t for_sample = TriangleTree::kAnywhere, for_point = TriangleTree::kAnywhere;
            for (std::size_t i = first; i < last; ++i) {
                const std::uint32_t t = from_tree.along_curve(i);
                for (std::size_t k = spread.first[t]; k < spread.first[t + std::size_t{1}]; ++k)
                    spread.samples[k].distance = to.distance(spread.samples[k].position, 0, for_sample);
                for (const std::uint32_t p : from.triangles[t]) {
                    if (triangle_of[p] == t) measure_point(p, for_point);
                }
            }
        });
    for (std::uint32_t p = 0; p < triangle_of.size(); ++p) {
        std::uint32_t guess = TriangleTree::kAnywhere;
        if (triangle_of[p] == kNone) measure_point(p, guess);
    }
    d.samples = std::move(spread.samples);
    return d;
}

MeshDistance symmetric(const Distances& there, const Distances& back) {
    return {(there.mean() + back.mean()) / 2, std::max(there.max(), back.max())};
}

}  // namespace internal

MeshDistance mesh_distance(MeshView a, MeshView b, const DistanceOptions& options) {
    if (options.samples < 1) throw InputError("mesh distance: there must be at least one sample");
    for (const MeshView& mesh : {a, b}) {
        if (mesh.triangles.empty()) throw InputError("mesh distance: a mesh has no triangles");
        check_indices(mesh);
    }
    MeshDistance result;
    with_threads(options.threads, [&] {
        const TriangleTree tree_a(a), tree_b(b);
        const DistanceSearch search{.samples = options.samples};
        const Distances there = distances(a, tree_a, tree_b, search, options.progress, 0, 0.5);
        const Distances back = distances(b, tree_b, tree_a, search, options.progress, 0.5, 1);
        result = symmetric(there, back);
    });
    return result;
}

}  // namespace marrow
