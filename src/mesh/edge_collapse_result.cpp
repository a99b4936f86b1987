// Copies what is left after collapses, and follows where points went.
#include "edge_collapse.h"

#include <numeric>
#include <utility>

namespace marrow::internal {

EdgeCollapse::Result EdgeCollapse::result() {
    Result result;
    Buffer<std::uint32_t> new_index(points_.size());
    result.mesh.points.reserve(alive_ / 2);
    result.old_points.reserve(alive_ / 2);
    for (std::uint32_t p = 0; p < points_.size(); ++p) {
        if (points_[p].outgoing == kNone) continue;
        new_index[p] = static_cast<std::uint32_t>(result.mesh.points.size());
        result.mesh.points.push_back(points_[p].position);
        result.old_points.push_back(p);
    }
    result.mesh.triangles.reserve(alive_);
    result.old_triangles.reserve(alive_);
    for (std::uint32_t t = 0; t < faces_.size(); ++t) {
        if (!faces_[t].alive) continue;
        result.old_triangles.push_back(t);
        const auto& [a, b, c] = faces_[t].from;
        if (points_[a].is_new || points_[b].is_new || points_[c].is_new)
            result.changed.push_back(static_cast<std::uint32_t>(result.mesh.triangles.size()));
        result.mesh.triangles.push_back({new_index[a], new_index[b], new_index[c]});
    }
    for (const std::uint32_t p : result.old_points) points_[p].is_new = false;
    return result;
}

Buffer<std::uint32_t> EdgeCollapse::merged_into() const {
    Buffer<std::uint32_t> result(points_.size());
    std::iota(result.begin(), result.end(), 0u);
    for (const Region& region : regions_) {
        for (const Collapse& c : region.log) {
            if (c.removed != kNone) result[c.removed] = from(c.half);
        }
    }
    // Follows each chain of points to its end, and shortens it.
    for (std::uint32_t p = 0; p < points_.size(); ++p) {
        std::uint32_t end = p;
        while (result[end] != end) end = result[end];
        for (std::uint32_t at = p; at != end;) at = std::exchange(result[at], end);
    }
    return result;
}

}  // namespace marrow::internal
