// Sums up the normals of triangles at the points of the surfaces of labels.
#include "label_normals.h"

#include <cstddef>

#include <marrow/buffer.h>
#include <marrow/vector.h>

#include "base/parallel.h"

namespace marrow::internal {
namespace {

// Unit normals at the points of a mesh: the sum of the normals of the triangles around each, weighted by
// area.
void add_normals(Mesh& mesh) {
    // Four numbers are faster than three; the fourth is 0.
    struct alignas(16) Vector {
        float values[4];
    };
    const std::size_t count = mesh.points.size();
    Buffer<Vector> points(count), sums(count);
    for (std::size_t p = 0; p < count; ++p) {
        const Vec3f& point = mesh.points[p];
        points[p] = {{point[0], point[1], point[2], 0}};
        sums[p] = {};
    }
    // The components of normals are in the order z, x, y, 0: value i follows from values i and i + 1 of both
    // edges. So the compiler makes vector code of these loops.
    constexpr std::size_t kNext[] = {1, 2, 0, 3};
    for (const Triangle& t : mesh.triangles) {
        const Vector &a = points[t[0]], &b = points[t[1]], &c = points[t[2]];
        Vector u, v, normal;
        for (std::size_t i = 0; i < 4; ++i) u.values[i] = b.values[i] - a.values[i];
        for (std::size_t i = 0; i < 4; ++i) v.values[i] = c.values[i] - a.values[i];
        for (std::size_t i = 0; i < 4; ++i)
            normal.values[i] = u.values[i] * v.values[kNext[i]] - u.values[kNext[i]] * v.values[i];
        for (const std::uint32_t p : t) {
            for (std::size_t i = 0; i < 4; ++i) sums[p].values[i] += normal.values[i];
        }
    }
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
    Stage stage(progress, 0, 1, surfaces.size());
    parallel_for(std::size_t{0}, surfaces.size(), [&](std::size_t i) {
        add_normals(surfaces[i].mesh);
        stage.step();
    });
}

}  // namespace marrow::internal
