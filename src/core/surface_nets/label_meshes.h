/// The meshes of labels, and how their points are those of one net.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <marrow/buffer.h>
#include <marrow/mesh.h>

#include "base/parallel.h"

namespace marrow::internal {

/// The meshes of labels, for each of their points its index in the net, and how many
/// of their points were held back.
struct LabelMeshes {
    std::vector<Mesh> meshes;
    std::vector<Buffer<std::uint32_t>> net_points;
    std::vector<std::int64_t> held_back_points = std::vector<std::int64_t>(meshes.size());
};

/// Calls f(triangle) for all triangles of a mesh, in order. Each of them is a step of the stage.
template <class F>
void for_each_triangle(const Mesh& mesh, Stage& stage, const F& f) {
    constexpr std::size_t kTogether = 65536;
    const std::size_t count = mesh.triangles.size();
    for (std::size_t begin = 0, end; begin < count; begin = end) {
        end = std::min(begin + kTogether, count);
        for (std::size_t i = begin; i < end; ++i) f(mesh.triangles[i]);
        stage.step(static_cast<double>(end - begin));
    }
}

/// Calls f(label, point of the label's mesh, point of the net).
template <class F>
void for_each_point(const LabelMeshes& labels, F f) {
    for (std::size_t l = 0; l < labels.meshes.size(); ++l) {
        for (std::size_t p = 0; p < labels.net_points[l].size(); ++p) f(l, p, labels.net_points[l][p]);
    }
}

/// The positions of the points of a net. Those that are in no mesh, since only the surface of the background
/// has them, are at 0.
inline Buffer<Vec3f> net_positions(const LabelMeshes& labels, std::size_t points) {
    Buffer<Vec3f> positions(points, Vec3f{});
    for_each_point(labels, [&](std::size_t l, std::size_t p, std::uint32_t net_point) {
        positions[net_point] = labels.meshes[l].points[p];
    });
    return positions;
}

}  // namespace marrow::internal
