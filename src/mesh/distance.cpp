// The distance of two meshes, from places spread over each.
#include <tbb/parallel_for.h>

#include <algorithm>
#include <numeric>

#include <marrow/error.h>
#include <marrow/measure.h>

#include "check_mesh.h"
#include "triangle_tree.h"
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

    Vec3d operator[](std::int64_t k) const {
        const double step = (static_cast<double>(k) + 0.5) / static_cast<double>(n_);
        const auto found =
            std::upper_bound(summed_area_.begin(), summed_area_.end() - 1, step * summed_area_.back());
        const Corners t(mesh_, mesh_.triangles[static_cast<std::size_t>(found - summed_area_.begin())]);
        double u = fraction(0.7548776662466927 * static_cast<double>(k));
        double v = fraction(0.5698402909980532 * static_cast<double>(k));
        if (u + v > 1) u = 1 - u, v = 1 - v;
        return t.a + u * (t.b - t.a) + v * (t.c - t.a);
    }

  private:
    static double fraction(double x) { return x - std::floor(x); }

    const Mesh& mesh_;
    const std::int64_t n_;
    std::vector<double> summed_area_;
};

// From places on `from` to the nearest ones on `to`.
MeshDistance one_way(const Mesh& from, const TriangleTree& to, std::int64_t samples) {
    const Places places(from, samples);
    std::vector<double> distances(static_cast<std::size_t>(samples)), at_points(from.points.size());
    tbb::parallel_for(std::size_t{0}, distances.size(), [&](std::size_t k) {
        distances[k] = to.distance(places[static_cast<std::int64_t>(k)]);
    });
    tbb::parallel_for(std::size_t{0}, at_points.size(),
                      [&](std::size_t p) { at_points[p] = to.distance(to_double(from.points[p])); });
    return {std::accumulate(distances.begin(), distances.end(), 0.0) / static_cast<double>(samples),
            std::max(*std::max_element(distances.begin(), distances.end()),
                     *std::max_element(at_points.begin(), at_points.end()))};
}

}  // namespace

MeshDistance mesh_distance(const Mesh& a, const Mesh& b, std::int64_t samples) {
    if (samples < 1) throw InputError("mesh distance: at least one sample is needed");
    for (const Mesh* mesh : {&a, &b}) {
        if (mesh->triangles.empty()) throw InputError("mesh distance: a mesh has no triangles");
        check_triangles(*mesh);
    }
    const MeshDistance there = one_way(a, TriangleTree(b), samples);
    const MeshDistance back = one_way(b, TriangleTree(a), samples);
    return {(there.mean + back.mean) / 2, std::max(there.max, back.max)};
}

}  // namespace marrow
