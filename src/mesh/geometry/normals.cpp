// Sums the weighted normals of the triangles at each point.
#include "normals.h"

#include <algorithm>
#include <cstddef>

#include <marrow/normals.h>

#include "base/parallel.h"
#include "triangle_corners.h"

namespace marrow::internal {

namespace {

// A unit normal for each point, from its triangles, weighted after Max 1999. If these cancel, the result is
// {1, 0, 0}. Each thread goes over all triangles, and sums at a part of the points. Neighbours have similar
// numbers, so few triangles concern several threads.
Buffer<Vec3f> point_normals(const MeshView& mesh) {
    const std::size_t points = mesh.points.size();
    Buffer<Vec3d> sums(points);
    Buffer<Vec3f> normals(points);
    const auto parts = static_cast<std::size_t>(thread_count());
    parallel_for(std::size_t{0}, parts, [&](std::size_t part) {
        const std::size_t begin = points * part / parts, end = points * (part + 1) / parts;
        const auto is_in_part = [&](std::uint32_t p) { return p - begin < end - begin; };
        std::fill(sums.begin() + static_cast<std::ptrdiff_t>(begin),
                  sums.begin() + static_cast<std::ptrdiff_t>(end), Vec3d{});
        for (const Triangle& t : mesh.triangles) {
            if (std::none_of(t.begin(), t.end(), is_in_part)) continue;
            const auto [a, b, c] = corners_of(mesh, t);
            const Vec3d ab = b - a, bc = c - b, ca = a - c;
            const Vec3d twice_area = cross(ab, bc);
            const double ab2 = dot(ab, ab), bc2 = dot(bc, bc), ca2 = dot(ca, ca);
            // The weight of a corner is 1 over the product of its two squared edge lengths.
            const auto add = [&](std::uint32_t p, double squares) {
                if (is_in_part(p) && squares > 0) sums[p] = sums[p] + (1 / squares) * twice_area;
            };
            add(t[0], ca2 * ab2);
            add(t[1], ab2 * bc2);
            add(t[2], bc2 * ca2);
        }
        for (std::size_t p = begin; p < end; ++p) {
            const double size = length(sums[p]);
            normals[p] = size > 0 ? to_float((1 / size) * sums[p]) : Vec3f{1, 0, 0};
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
