// Spreads samples over each surface and measures their distances to the other surface.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>
#include <optional>
#include <vector>

#include <marrow/error.h>
#include <marrow/measure.h>

#include "base/checked_size.h"
#include "base/parallel.h"
#include "check_indices.h"
#include "distance.h"
#include "for_each_range.h"
#include "triangle_corners.h"

namespace marrow {

using namespace internal;

namespace {

double fraction(double x) {
    return x - std::floor(x);
}

// The k-th position in a triangle, of the additive sequence of the plastic number (Roberts 2018).
Vec3d spread_position(const TriangleCorners& t, double k) {
    double u = fraction(0.7548776662466927 * k), v = fraction(0.5698402909980532 * k);
    if (u + v > 1) u = 1 - u, v = 1 - v;
    return t[0] + u * (t[1] - t[0]) + v * (t[2] - t[0]);
}

}  // namespace

namespace internal {

SampledMesh::SampledMesh(const MeshView& mesh, std::int64_t samples)
    : mesh_(mesh), triangle_of_(mesh.points.size(), kNone) {
    parallel_invoke([&] { tree_.emplace(mesh); }, [&] { spread_samples(samples); },
                    [&] {
                        for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
                            for (const std::uint32_t p : mesh.triangles[t]) triangle_of_[p] = t;
                        }
                    });
}

// Equal steps along the summed areas of the triangles choose the triangle of each sample.
void SampledMesh::spread_samples(std::int64_t count) {
    const std::size_t triangles = mesh_.triangles.size();
    std::vector<double> summed_area;
    summed_area.reserve(triangles);
    double sum = 0;
    for (const Triangle& t : mesh_.triangles) summed_area.push_back(sum += area(corners_of(mesh_, t)));
    samples_.resize(checked_size(static_cast<std::uint64_t>(count), sizeof samples_[0]));
    first_sample_.reserve(triangles + 1);
    std::size_t k = 0;
    for (std::size_t t = 0; t < triangles; ++t) {
        first_sample_.push_back(k);
        const auto is_within = [&] {
            return t + 1 == triangles ||
                   (static_cast<double>(k) + 0.5) / static_cast<double>(count) * sum < summed_area[t];
        };
        for (; k < samples_.size() && is_within(); ++k)
            samples_[k] = spread_position(corners_of(mesh_, mesh_.triangles[t]), static_cast<double>(k));
    }
    first_sample_.push_back(k);
}

double Distances::max() const {
    return std::max(*std::max_element(points.begin(), points.end()),
                    *std::max_element(samples.begin(), samples.end()));
}

double Distances::mean() const {
    return std::accumulate(samples.begin(), samples.end(), 0.0) / static_cast<double>(samples.size());
}

Distances distances(const SampledMesh& from, const TriangleTree& to, const Progress& progress, double begin,
                    double end) {
    const MeshView& mesh = from.mesh();
    Distances d;
    d.samples.resize(from.sample_count());
    d.points.resize(mesh.points.size());
    // A point that is nearer than the furthest point so far does not change the maximum.
    std::atomic<double> furthest = 0;
    const auto measure_point = [&](std::uint32_t p, std::uint32_t& guess) {
        double known = furthest.load(std::memory_order_relaxed);
        const double distance = to.distance(to_double(mesh.points[p]), known, guess);
        while (distance > known &&
               !furthest.compare_exchange_weak(known, distance, std::memory_order_relaxed)) {
        }
        d.points[p] = distance;
    };
    // Along the curve of the tree, the nearest triangle to one sample is a good guess for the next.
    for_each_range(
        mesh.triangles.size(), 256, progress, begin, end, [&](std::size_t first, std::size_t last) {
            std::uint32_t for_sample = TriangleTree::kAnywhere, for_point = TriangleTree::kAnywhere;
            for (std::size_t i = first; i < last; ++i) {
                const std::uint32_t t = from.tree().along_curve(i);
                for (std::size_t k = from.first_sample(t); k < from.first_sample(t + std::size_t{1}); ++k)
                    d.samples[k] = to.distance(from.sample(k), 0, for_sample);
                for (const std::uint32_t p : mesh.triangles[t]) {
                    if (from.belongs_to(p, t)) measure_point(p, for_point);
                }
            }
        });
    for (std::uint32_t p = 0; p < mesh.points.size(); ++p) {
        std::uint32_t guess = TriangleTree::kAnywhere;
        if (from.is_unused(p)) measure_point(p, guess);
    }
    return d;
}

std::vector<Triangle> find_further(const SampledMesh& from, const TriangleTree& to, double max_distance,
                                   const Progress& progress, double begin, double end) {
    const MeshView& mesh = from.mesh();
    constexpr std::size_t kRange = 256;
    // A list for each range, and one for points without triangles.
    std::vector<std::vector<Triangle>> found(mesh.triangles.size() / kRange + 2);
    const auto look_at_point = [&](std::uint32_t p, std::uint32_t& guess, std::vector<Triangle>& list) {
        if (!to.is_within(to_double(mesh.points[p]), max_distance, guess)) list.push_back({p, p, p});
    };
    for_each_range(
        mesh.triangles.size(), kRange, progress, begin, end, [&](std::size_t first, std::size_t last) {
            std::uint32_t guess = TriangleTree::kAnywhere;
            std::vector<Triangle>& list = found[first / kRange];
            for (std::size_t i = first; i < last; ++i) {
                const std::uint32_t t = from.tree().along_curve(i);
                const Triangle& corners = mesh.triangles[t];
                for (std::size_t k = from.first_sample(t); k < from.first_sample(t + std::size_t{1}); ++k) {
                    if (!to.is_within(from.sample(k), max_distance, guess)) list.push_back(corners);
                }
                for (const std::uint32_t p : corners) {
                    if (from.belongs_to(p, t)) look_at_point(p, guess, list);
                }
            }
        });
    for (std::uint32_t p = 0; p < mesh.points.size(); ++p) {
        std::uint32_t guess = TriangleTree::kAnywhere;
        if (from.is_unused(p)) look_at_point(p, guess, found.back());
    }
    std::vector<Triangle> all;
    for (const std::vector<Triangle>& list : found) all.insert(all.end(), list.begin(), list.end());
    return all;
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
        std::optional<SampledMesh> from_a, from_b;
        parallel_invoke([&] { from_a.emplace(a, options.samples); },
                        [&] { from_b.emplace(b, options.samples); });
        const Distances there = distances(*from_a, from_b->tree(), options.progress, 0, 0.5);
        const Distances back = distances(*from_b, from_a->tree(), options.progress, 0.5, 1);
        result = symmetric(there, back);
    });
    return result;
}

}  // namespace marrow
