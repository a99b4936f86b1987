// Joins the surfaces of blocks to one mesh.
#include "joined_mesh.h"

#include <cmath>
#include <limits>

#include <marrow/error.h>

namespace marrow::internal::terrain {

namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

}  // namespace

void JoinedMesh::add(const BlockSurface& block) {
    index_.assign(block.points.size(), kNone);
    for (const Triangle& t : block.triangles) {
        Triangle joined;
        for (std::size_t c = 0; c < 3; ++c) joined[c] = index_of(block, t[c]);
        // At a corner of the ground's border, edges with the same sample have the same point, and the
        // triangle has no area.
        if (joined[0] != joined[1] && joined[1] != joined[2] && joined[2] != joined[0])
            mesh_.triangles.push_back(joined);
    }
}

std::vector<Vec3d> JoinedMesh::corners_from(std::size_t first_triangle, double exaggerate) const {
    std::vector<Vec3d> corners;
    for (std::size_t t = first_triangle; t < mesh_.triangles.size(); ++t) {
        for (const std::uint32_t p : mesh_.triangles[t]) {
            const Vec3f& at = mesh_.points[p];
            corners.push_back({at[0] / info_.mm_per_metre + info_.centre[0],
                               at[1] / info_.mm_per_metre + info_.centre[1],
                               (at[2] / info_.mm_per_metre + zero()) / exaggerate});
        }
    }
    return corners;
}

std::uint32_t JoinedMesh::index_of(const BlockSurface& block, std::uint32_t point) {
    std::uint32_t& index = index_[point];
    if (index != kNone) return index;
    const std::uint64_t edge = block.shared[point];
    if (edge == BlockSurface::kOwn) return index = append(block.points[point]);
    const auto [at, added] = index_on_edge_.try_emplace(edge, kNone);
    if (added) at->second = append(block.points[point]);
    return index = at->second;
}

std::uint32_t JoinedMesh::append(const Vec3d& p) {
    if (mesh_.points.size() >= kNone)
        throw LimitError("the terrain has more than 2^32 - 1 points: give a larger options.cell");
    const double scale = info_.mm_per_metre;
    const auto plan = [&](std::size_t axis, std::int64_t samples) {
        const double from_centre = (p[axis] - static_cast<double>(samples - 1) / 2) * info_.cell[axis];
        return static_cast<float>((from_centre + off_centre_[axis]) * scale);
    };
    mesh_.points.push_back(
        {plan(0, grid_.columns), plan(1, grid_.rows), static_cast<float>((p[2] - zero()) * scale)});
    return static_cast<std::uint32_t>(mesh_.points.size() - 1);
}

void JoinedMesh::add_normals() {
    Mesh& mesh = mesh_;
    mesh.normals.assign(mesh.points.size(), {0, 0, 0});
    for (const Triangle& t : mesh.triangles) {
        const Vec3f &a = mesh.points[t[0]], &b = mesh.points[t[1]], &c = mesh.points[t[2]];
        const Vec3f u{b[0] - a[0], b[1] - a[1], b[2] - a[2]}, v{c[0] - a[0], c[1] - a[1], c[2] - a[2]};
        for (const std::uint32_t p : t) {
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const std::size_t y = (axis + 1) % 3, z = (axis + 2) % 3;
                mesh.normals[p][axis] += u[y] * v[z] - u[z] * v[y];
            }
        }
    }
    for (Vec3f& n : mesh.normals) {
        const double length = std::hypot(double{n[0]}, double{n[1]}, double{n[2]});
        if (!(length > 0))
            n = {0, 0, 1};
        else
            for (float& x : n) x = static_cast<float>(x / length);
    }
}

}  // namespace marrow::internal::terrain
