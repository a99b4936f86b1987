// Replaces normals that point against their faces. Only a point with a face that its normal points against
// can be one of them, so the faces are summed at these points alone: one in thirty.
#include <algorithm>
#include <atomic>
#include <cstddef>

#include <marrow/normals.h>

#include "base/parallel.h"
#include "triangle_corners.h"

namespace marrow {

using namespace internal;

namespace {

// The normal of a face as long as twice its area. `t` counts from the first point of the part.
Vec3d normal_of(const SurfacePart& part, const std::array<std::size_t, 3>& t) {
    return scaled_normal(
        {to_double(part.points[t[0]]), to_double(part.points[t[1]]), to_double(part.points[t[2]])});
}

std::array<std::size_t, 3> in_part(const SurfacePart& part, const Triangle& t) {
    const auto in = [&](std::uint32_t point) { return static_cast<std::size_t>(point - part.first_point); };
    return {in(t[0]), in(t[1]), in(t[2])};
}

// Marks the points with a face that their normal does not agree with.
std::vector<std::uint8_t> points_against_a_face(const SurfacePart& part, int threads) {
    std::vector<std::uint8_t> marks(part.points.size(), 0);
    with_threads(threads, [&] {
        parallel_for_ranges(std::size_t{0}, part.triangles.size(), 4096, [&](const auto& range) {
            for (std::size_t i = range.begin(); i < range.end(); ++i) {
                const std::array<std::size_t, 3> t = in_part(part, part.triangles[i]);
                const Vec3d normal = normal_of(part, t);
                for (const std::size_t p : t) {
                    if (!(dot(normal, to_double(part.normals[p])) > 0))
                        std::atomic_ref(marks[p]).store(1, std::memory_order_relaxed);
                }
            }
        });
    });
    return marks;
}

Vec3d unit(const Vec3d& v) {
    const double size = length(v);
    return size > 0 ? (1 / size) * v : v;
}

}  // namespace

std::vector<OutwardNormals::Replacement> OutwardNormals::add(const SurfacePart& part, int threads) {
    std::vector<std::uint8_t> marks = points_against_a_face(part, threads);
    for (std::size_t p = 0; p < shared_.size(); ++p) marks[p] |= shared_[p].face_against;

    // Any of the points that the next part shares may turn out to have such a face there.
    const std::size_t complete = part.complete_points;
    std::vector<std::size_t> summed;
    const auto is_summed = [&](std::size_t p) { return p >= complete || marks[p] != 0; };
    for (std::size_t p = 0; p < part.points.size(); ++p) {
        if (is_summed(p)) summed.push_back(p);
    }
    std::vector<Faces> faces(summed.size());
    for (std::size_t i = 0; i < summed.size(); ++i) {
        if (summed[i] < shared_.size()) faces[i] = shared_[summed[i]];
        faces[i].face_against = marks[summed[i]] != 0;
    }
    shared_ = std::vector<Faces>();  // gives the memory back
    for (const Triangle& triangle : part.triangles) {
        const std::array<std::size_t, 3> t = in_part(part, triangle);
        if (std::none_of(t.begin(), t.end(), is_summed)) continue;
        const Vec3d normal = normal_of(part, t);
        for (const std::size_t p : t) {
            if (!is_summed(p)) continue;
            Faces& at = faces[static_cast<std::size_t>(std::lower_bound(summed.begin(), summed.end(), p) -
                                                       summed.begin())];
            at.units = at.units + unit(normal);
            at.areas = at.areas + normal;
        }
    }

    std::vector<Replacement> replaced;
    replaced.reserve(summed.size());
    std::size_t i = 0;
    for (; i < summed.size() && summed[i] < complete; ++i) {
        const Vec3d normal = to_double(part.normals[summed[i]]);
        if (dot(normal, faces[i].units) > 0 && dot(normal, faces[i].areas) > 0) continue;
        const Vec3d between = unit(faces[i].units) + unit(faces[i].areas);
        if (length(between) > 0) replaced.push_back({part.first_point + summed[i], to_float(unit(between))});
    }
    faces.erase(faces.begin(), faces.begin() + static_cast<std::ptrdiff_t>(i));
    shared_ = std::move(faces);
    return replaced;
}

std::size_t turn_normals_outward(Mesh& mesh, int threads) {
    if (mesh.normals.empty()) return 0;
    const SurfacePart whole{0, mesh.points, mesh.normals, 0, mesh.triangles, mesh.points.size()};
    const std::vector<OutwardNormals::Replacement> replaced = OutwardNormals().add(whole, threads);
    for (const auto& [point, normal] : replaced) mesh.normals[static_cast<std::size_t>(point)] = normal;
    return replaced.size();
}

}  // namespace marrow
