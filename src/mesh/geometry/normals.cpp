// Sums the weighted normals of the triangles at each point.
#include "normals.h"

#include <algorithm>
#include <cstddef>
#include <vector>

#include <marrow/normals.h>

#include "base/parallel.h"
#include "mesh/connectivity/point_bands.h"
#include "triangle_corners.h"

namespace marrow::internal {

namespace {

// A unit normal for each point, from its triangles, weighted after Max 1999. If these cancel, the result is
// {1, 0, 0}.
Buffer<Vec3f> point_normals(const MeshView& mesh) {
    Buffer<Vec3f> normals(mesh.points.size());
    const PointBands bands(mesh);
    PerThread<std::vector<Vec3d>> sums_of_thread;
    bands.for_each([&](const PointBands::Band& band) {
        std::vector<Vec3d>& sums = sums_of_thread.local();
        sums.assign(band.size(), Vec3d{});
        bands.for_each_triangle(band, [&](std::size_t i, const auto& is_inside) {
            const Triangle& t = mesh.triangles[i];
            if (std::none_of(t.begin(), t.end(), is_inside)) return;
            const auto [a, b, c] = corners_of(mesh, t);
            const Vec3d ab = b - a, bc = c - b, ca = a - c;
            const Vec3d twice_area = cross(ab, bc);
            const double ab2 = dot(ab, ab), bc2 = dot(bc, bc), ca2 = dot(ca, ca);
            // The weight of a corner is 1 over the product of its two squared edge lengths.
            const auto add = [&](std::uint32_t p, double squares) {
                if (!is_inside(p) || !(squares > 0)) return;
                Vec3d& sum = sums[p - band.begin];
                sum = sum + (1 / squares) * twice_area;
            };
            add(t[0], ca2 * ab2);
            add(t[1], ab2 * bc2);
            add(t[2], bc2 * ca2);
        });
        for (std::size_t p = 0; p < band.size(); ++p) {
            const double size = length(sums[p]);
            normals[band.begin + p] = size > 0 ? to_float((1 / size) * sums[p]) : Vec3f{1, 0, 0};
        }
    });
    return normals;
}

}  // namespace

void set_normals(Mesh& mesh) {
    mesh.normals = point_normals(mesh);
    turn_normals_outward(mesh, thread_count());
}

}  // namespace marrow::internal
