// The distance of two meshes, from places spread over each.
#include <tbb/parallel_for.h>

#include <algorithm>
#include <numeric>

#include <marrow/error.h>
#include <marrow/measure.h>

#include "check_mesh.h"
#include "distance.h"
#include "vector.h"

namespace marrow {

using namespace internal;

namespace {

// Place k of n spreads over the mesh by area: equal steps along the triangles' summed areas pick the
// triangle, the additive sequence of the plastic number (Roberts 2018) the place in it.
class Places {
  public:
    Places(const Mesh& mesh, std::int64_t n) : mesh_(mesh), n_(n) {
        summed_area_.reserve(mesh.triangles.size());
        double sum = 0;
        for (const Triangle& t : mesh.triangles) summed_area_.push_back(sum += Corners(mesh, t).area());
    }

    Distances::Place operator[](std::int64_t k) const {
        const double step = (static_cast<double>(k) + 0.5) / static_cast<double>(n_);
        const auto found =
            std::upper_bound(summed_area_.begin(), summed_area_.end() - 1, step * summed_area_.back());
        const auto triangle = static_cast<std::uint32_t>(found - summed_area_.begin());
        const Corners t(mesh_, mesh_.triangles[triangle]);
        double u = fraction(0.7548776662466927 * static_cast<double>(k));
        double v = fraction(0.5698402909980532 * static_cast<double>(k));
        if (u + v > 1) u = 1 - u, v = 1 - v;
        return {t.a + u * (t.b - t.a) + v * (t.c - t.a), triangle, 0};
    }

  private:
    static double fraction(double x) { return x - std::floor(x); }

    const Mesh& mesh_;
    const std::int64_t n_;
    std::vector<double> summed_area_;
};

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

Distances distances(const Mesh& from, const TriangleTree& to, std::int64_t samples) {
    const Places places(from, samples);
    Distances d;
    d.places.resize(static_cast<std::size_t>(samples));
    d.points.resize(from.points.size());
    // One after the other they lie near each other mostly.
    using Range = tbb::blocked_range<std::size_t>;
    tbb::parallel_for(Range(0, d.places.size(), 256), [&](const Range& range) {
        std::size_t leaf = 0;
        for (std::size_t k = range.begin(); k < range.end(); ++k) {
            d.places[k] = places[static_cast<std::int64_t>(k)];
            d.places[k].distance = to.distance(d.places[k].place, leaf);
        }
    });
    tbb::parallel_for(Range(0, d.points.size(), 256), [&](const Range& range) {
        std::size_t leaf = 0;
        for (std::size_t p = range.begin(); p < range.end(); ++p)
            d.points[p] = to.distance(to_double(from.points[p]), leaf);
    });
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
    return symmetric(distances(a, TriangleTree(b), samples), distances(b, TriangleTree(a), samples));
}

}  // namespace marrow
