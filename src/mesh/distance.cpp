// The distance of two meshes, from places spread over each.
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>
#include <utility>

#include <marrow/error.h>
#include <marrow/measure.h>

#include "check_indices.h"
#include "distance.h"
#include "vector.h"

namespace marrow {

using namespace internal;

namespace {

// Places spread over a mesh by area: of n, equal steps along the triangles' summed areas pick the triangle of place k,
// the additive sequence of the plastic number (Roberts 2018) the place in it.
struct Places {
    std::vector<Distances::Place> all;
    std::vector<std::size_t> first;  // of each triangle; then their number

    Places(const Mesh& mesh, std::int64_t n) : all(static_cast<std::size_t>(n)) {
        std::vector<double> summed_area;
        summed_area.reserve(mesh.triangles.size());
        double sum = 0;
        for (const Triangle& t : mesh.triangles) summed_area.push_back(sum += Corners(mesh, t).area());
        first.reserve(mesh.triangles.size() + 1);
        std::size_t k = 0;
        for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
            first.push_back(k);
            const bool last = t + std::size_t{1} == mesh.triangles.size();
            for (; k < all.size() &&
                   (last || (static_cast<double>(k) + 0.5) / static_cast<double>(n) * sum < summed_area[t]);
                 ++k)
                all[k] = {place(Corners(mesh, mesh.triangles[t]), static_cast<double>(k)), t, 0};
        }
        first.push_back(k);
    }

  private:
    static Vec3d place(const Corners& t, double k) {
        double u = fraction(0.7548776662466927 * k), v = fraction(0.5698402909980532 * k);
        if (u + v > 1) u = 1 - u, v = 1 - v;
        return t.a + u * (t.b - t.a) + v * (t.c - t.a);
    }
    static double fraction(double x) { return x - std::floor(x); }
};

// One of the triangles of each point; kNone where it has none.
constexpr std::uint32_t kNone = ~std::uint32_t{0};
std::vector<std::uint32_t> a_triangle_of_each(const Mesh& mesh) {
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
    for (const Place& p : places) max = std::max(max, p.distance);
    return max;
}

double Distances::mean() const {
    const auto add = [](double sum, const Place& p) { return sum + p.distance; };
    return std::accumulate(places.begin(), places.end(), 0.0, add) / static_cast<double>(places.size());
}

Distances distances(const Mesh& from, const TriangleTree& from_tree, const TriangleTree& to,
                    std::int64_t samples, double enough) {
    Places places(from, samples);
    const std::vector<std::uint32_t> triangle_of = a_triangle_of_each(from);
    Distances d;
    d.points.resize(from.points.size());
    // A point that is no further than another one tells nothing.
    std::atomic<double> furthest = 0;
    const auto ask_point = [&](std::uint32_t p, std::uint32_t& guess) {
        double known = furthest.load(std::memory_order_relaxed);
        const double distance = to.distance(to_double(from.points[p]), std::min(known, enough), guess);
        while (distance > known &&
               !furthest.compare_exchange_weak(known, distance, std::memory_order_relaxed)) {
        }
        d.points[p] = distance;
    };
    // In the order of the tree, where one is near the other, and so is what is nearest to them. In the same shares for any
    // number of threads, so that searches begin where they did.
    const tbb::blocked_range<std::size_t> triangles(0, from.triangles.size(), 256);
    const auto ask = [&](const tbb::blocked_range<std::size_t>& share) {
        std::uint32_t for_place = TriangleTree::kAnywhere, for_point = TriangleTree::kAnywhere;
        for (std::size_t i = share.begin(); i < share.end(); ++i) {
            const std::uint32_t t = from_tree.along_curve(i);
            for (std::size_t k = places.first[t]; k < places.first[t + std::size_t{1}]; ++k)
                places.all[k].distance = to.distance(places.all[k].place, 0, for_place);
            for (const std::uint32_t p : from.triangles[t]) {
                if (triangle_of[p] == t) ask_point(p, for_point);
            }
        }
    };
    tbb::parallel_for(triangles, ask, tbb::simple_partitioner());
    for (std::uint32_t p = 0; p < triangle_of.size(); ++p) {
        std::uint32_t guess = TriangleTree::kAnywhere;
        if (triangle_of[p] == kNone) ask_point(p, guess);
    }
    d.places = std::move(places.all);
    return d;
}

MeshDistance symmetric(const Distances& there, const Distances& back) {
    return {(there.mean() + back.mean()) / 2, std::max(there.max(), back.max())};
}

}  // namespace internal

MeshDistance mesh_distance(const Mesh& a, const Mesh& b, std::int64_t samples) {
    if (samples < 1) throw InputError("mesh distance: at least one sample is needed");
    for (const Mesh* mesh : {&a, &b}) {
        if (mesh->triangles.empty()) throw InputError("mesh distance: a mesh has no triangles");
        check_triangles(*mesh);
    }
    const TriangleTree tree_a(a), tree_b(b);
    return symmetric(distances(a, tree_a, tree_b, samples), distances(b, tree_b, tree_a, samples));
}

}  // namespace marrow
