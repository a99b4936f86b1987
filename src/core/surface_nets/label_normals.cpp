// Sums up the normals of triangles at the points of the surfaces of labels.
#include "label_normals.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <marrow/buffer.h>
#include <marrow/vector.h>

#include "base/parallel.h"
#include "label_meshes.h"

namespace marrow::internal {
namespace {

// A power of two by which very large or very small coordinates are multiplied, which is exact, so that areas
// are neither infinite nor 0 as floats.
double scale_for_areas(const Buffer<Vec3f>& points) {
    constexpr int kUsual = 40;
    float largest = 0;
    for (const Vec3f& p : points)
        largest = std::max({largest, std::abs(p[0]), std::abs(p[1]), std::abs(p[2])});
    const int exponent = largest > 0 ? std::ilogb(largest) : 0;
    return std::abs(exponent) > kUsual ? std::ldexp(1.0, -exponent) : 1;
}

// Unit normals at the points of a mesh: the sum of the normals of the triangles around each, weighted by
// area.
void add_normals(Mesh& mesh, Stage& stage) {
    // Four numbers are faster than three; the fourth is 0.
    struct alignas(16) Vector {
        float values[4];
    };
    const std::size_t count = mesh.points.size();
    const double scale = scale_for_areas(mesh.points);
    const auto scaled = [&](float coordinate) { return static_cast<float>(scale * double{coordinate}); };
    Buffer<Vector> points(count), sums(count);
    for (std::size_t p = 0; p < count; ++p) {
        const Vec3f& point = mesh.points[p];
        points[p] = {{scaled(point[0]), scaled(point[1]), scaled(point[2]), 0}};
        sums[p] = {};
    }
    // The components of normals are in the order z, x, y, 0: value i follows from values i and i + 1 of both
    // edges. So the compiler makes vector code of these loops.
    constexpr std::size_t kNext[] = {1, 2, 0, 3};
    for_each_triangle(mesh, stage, [&](const Triangle& t) {
        const Vector &a = points[t[0]], &b = points[t[1]], &c = points[t[2]];
        Vector u, v, normal;
        for (std::size_t i = 0; i < 4; ++i) u.values[i] = b.values[i] - a.values[i];
        for (std::size_t i = 0; i < 4; ++i) v.values[i] = c.values[i] - a.values[i];
        for (std::size_t i = 0; i < 4; ++i)
            normal.values[i] = u.values[i] * v.values[kNext[i]] - u.values[kNext[i]] * v.values[i];
        for (const std::uint32_t p : t) {
            for (std::size_t i = 0; i < 4; ++i) sums[p].values[i] += normal.values[i];
        }
    });
    mesh.normals.resize(count);
    for (std::size_t p = 0; p < count; ++p) {
        const auto [z, x, y, unused] = sums[p].values;
        // Squares of areas could be too large or too small for a float.
        const Vec3d sum{x, y, z};
        const double size = length(sum);
        // Where the triangles cancel each other, any direction will do.
        mesh.normals[p] = size > 0 ? to_float((1 / size) * sum) : Vec3f{0, 0, 1};
    }
}

}  // namespace

void add_label_normals(std::vector<LabelSurface>& surfaces, const Progress& progress) {
    std::size_t triangles = 0;
    for (const LabelSurface& surface : surfaces) triangles += surface.mesh.triangles.size();
    Stage stage(progress, 0, 1, triangles);
    parallel_for(std::size_t{0}, surfaces.size(),
                 [&](std::size_t i) { add_normals(surfaces[i].mesh, stage); });
}

}  // namespace marrow::internal
