// Copies what is left after collapses, and follows where points went.
#include "edge_collapse.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace marrow::internal {

namespace {

constexpr std::size_t kSection = 8192;

template <class F>
void for_each_number(std::size_t count, const F& f) {
    parallel_for_ranges(std::size_t{0}, count, kSection, [&](const auto& range) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) f(i);
    });
}

// The numbers below `count` for which f is true, in ascending order.
template <class F>
std::vector<std::uint32_t> numbers_where(std::size_t count, const F& f) {
    std::vector<std::vector<std::uint32_t>> sections((count + kSection - 1) / kSection);
    parallel_for(std::size_t{0}, sections.size(), [&](std::size_t s) {
        for (std::size_t i = s * kSection; i < std::min((s + 1) * kSection, count); ++i)
            if (f(i)) sections[s].push_back(static_cast<std::uint32_t>(i));
    });
    std::vector<std::uint32_t> numbers;
    for (const std::vector<std::uint32_t>& section : sections)
        numbers.insert(numbers.end(), section.begin(), section.end());
    return numbers;
}

}  // namespace

EdgeCollapse::Result EdgeCollapse::result() {
    Result result;
    result.old_points =
        numbers_where(points_.size(), [&](std::size_t p) { return points_[p].outgoing != kNone; });
    result.old_triangles = numbers_where(faces_.size(), [&](std::size_t t) { return faces_[t].alive; });
    const std::vector<std::uint32_t>&points = result.old_points, &triangles = result.old_triangles;
    Buffer<std::uint32_t> new_index(points_.size());
    Buffer<std::uint8_t> is_new(points.size());
    result.mesh.points.resize(points.size());
    for_each_number(points.size(), [&](std::size_t p) {
        Point& point = points_[points[p]];
        new_index[points[p]] = static_cast<std::uint32_t>(p);
        result.mesh.points[p] = point.position;
        is_new[p] = point.is_new ? 1 : 0;
        point.is_new = false;
    });
    result.mesh.triangles.resize(triangles.size());
    for_each_number(triangles.size(), [&](std::size_t t) {
        const auto& [a, b, c] = faces_[triangles[t]].from;
        result.mesh.triangles[t] = {new_index[a], new_index[b], new_index[c]};
    });
    result.changed = numbers_where(triangles.size(), [&](std::size_t t) {
        const auto& [a, b, c] = result.mesh.triangles[t];
        return (is_new[a] | is_new[b] | is_new[c]) != 0;
    });
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
