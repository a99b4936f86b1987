// Joins the meshes of labels to their net, and holds the net's points back.
#include "hold_back_labels.h"

#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <marrow/error.h>

#include "base/checked_size.h"
#include "base/progress.h"
#include "folds.h"
#include "mesh/connectivity/one_rings.h"
#include "mesh/smoothing/hold_back.h"

namespace marrow::internal {
namespace {

// The whole net as one mesh. It has each triangle once, although the labels on both of its sides have it.
Mesh join(const LabelMeshes& labels, std::size_t points, const Progress& progress) {
    constexpr std::uint32_t kNone = ~std::uint32_t{0};
    Mesh net;
    net.points = net_positions(labels, points);
    // For each point, the last triangle whose lowest corner it is; for each triangle, the one before it.
    std::vector<std::uint32_t> last(points, kNone), before;
    std::uint64_t at_most = 0;
    for (const Mesh& mesh : labels.meshes) at_most += mesh.triangles.size();
    if (at_most >> 32)
        throw LimitError("labels: all surfaces together have 2^32 triangles or more; use fewer labels");
    net.triangles.reserve(checked_size(at_most, sizeof(Triangle)));
    Stage stage(progress, 0, 1, at_most);
    for (std::size_t l = 0; l < labels.meshes.size(); ++l) {
        const Buffer<std::uint32_t>& of_net = labels.net_points[l];
        for_each_triangle(labels.meshes[l], stage, [&](const Triangle& corners) {
            Triangle t{of_net[corners[0]], of_net[corners[1]], of_net[corners[2]]};
            std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
            const auto is_flipped = [&](const Triangle& other) {
                return other[1] == t[2] && other[2] == t[1];
            };
            std::uint32_t at = last[t[0]];
            while (at != kNone && !is_flipped(net.triangles[at])) at = before[at];
            if (at != kNone) return;
            before.push_back(std::exchange(last[t[0]], static_cast<std::uint32_t>(net.triangles.size())));
            net.triangles.push_back(t);
        });
    }
    return net;
}

}  // namespace

void hold_back_labels(LabelMeshes& labels, std::size_t points,
                      const std::function<Buffer<Vec3f>(const Progress&)>& before_relaxation,
                      const Progress& progress) {
    Mesh joined = join(labels, points, sub_progress(progress, 0, 0.2));
    double done = 0.2;
    // Work of which nobody knows whether and how often it is done.
    const Progress stay = !progress ? Progress() : [&](double) { return progress(done); };
    Buffer<Vec3f> start;
    const auto keep_start = [&] {
        if (start.empty()) start = before_relaxation(stay);
        return std::span<const Vec3f>(start);
    };
    const OneRings rings(joined);
    report_progress(stay, 0);
    Folds folds(joined, stay);
    bool moved = folds.open(keep_start, stay);
    // Points that are held back can fold other triangles. This ends, because points
    // only move towards their start.
    double begin = std::exchange(done, 1);
    while (hold_back(joined, rings, keep_start, progress, begin, 1) > 0) {
        moved = true;
        if (!folds.open(keep_start, stay)) break;
        begin = 1;
    }
    if (!moved) return;
    for_each_point(labels, [&](std::size_t l, std::size_t p, std::uint32_t net_point) {
        Vec3f& point = labels.meshes[l].points[p];
        labels.held_back_points[l] += point != joined.points[net_point];
        point = joined.points[net_point];
    });
}

}  // namespace marrow::internal
