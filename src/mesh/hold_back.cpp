// Moves the corners of intersecting triangles back in rounds: by half of their path, three quarters, seven
// eighths, and so on to the start. As rounds go by, their neighbours move back too. If nothing else helps,
// everything ends at the start, which is valid.
#include "hold_back.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <utility>
#include <vector>

#include "self_intersections.h"

namespace marrow::internal {

namespace {

// The number of times that a point moved back. A point that moved kAtStart times is at its start.
using Steps = std::uint8_t;
constexpr Steps kAtStart = 5;

Vec3f along_path(const Vec3f& start, const Vec3f& end, Steps steps) {
    if (steps == kAtStart) return start;
    return to_float(to_double(start) + std::ldexp(1.0, -steps) * (to_double(end) - to_double(start)));
}

using Numbers = std::vector<std::uint32_t>;

void sort_out(Numbers& set) {
    std::sort(set.begin(), set.end());
    set.erase(std::unique(set.begin(), set.end()), set.end());
}

// The corners of the intersecting triangles, except where all are at their starts: it was so at the start.
Numbers corners_that_intersect(const Mesh& mesh, const std::vector<TrianglePair>& pairs,
                               const std::vector<Steps>& steps) {
    Numbers points;
    for (const auto& [s, t] : pairs) {
        const auto can_move = [&](std::uint32_t p) { return steps[p] < kAtStart; };
        const Triangle &a = mesh.triangles[s], &b = mesh.triangles[t];
        if (std::none_of(a.begin(), a.end(), can_move) && std::none_of(b.begin(), b.end(), can_move))
            continue;
        points.insert(points.end(), a.begin(), a.end());
        points.insert(points.end(), b.begin(), b.end());
    }
    sort_out(points);
    return points;
}

// The triangles with corners in a set.
Numbers triangles_with(const SelfIntersections& search, const Numbers& points) {
    Numbers triangles;
    for (const std::uint32_t p : points) {
        const Numbers at_point = search.triangles_at(p);
        triangles.insert(triangles.end(), at_point.begin(), at_point.end());
    }
    sort_out(triangles);
    return triangles;
}

// Adds the neighbours of the points in a set.
void grow(const Mesh& mesh, const SelfIntersections& search, Numbers& points) {
    Numbers grown = points;
    for (const std::uint32_t t : triangles_with(search, points))
        grown.insert(grown.end(), mesh.triangles[t].begin(), mesh.triangles[t].end());
    sort_out(grown);
    points = std::move(grown);
}

}  // namespace

std::size_t hold_back(Mesh& mesh, const OneRings& rings, const std::function<std::span<const Vec3f>()>& start,
                      const Progress& progress, double begin, double end) {
    std::vector<TrianglePair> pairs = find_self_intersections(mesh, rings, progress, begin, end);
    if (pairs.empty()) return 0;
    SelfIntersections search(mesh);
    const std::span<const Vec3f> from = start();
    std::vector<Steps> steps(mesh.points.size(), 0);
    std::unordered_map<std::uint32_t, Vec3f> ends;  // of the paths of points that have moved back
    for (int round = 0;; ++round) {
        Numbers moved = corners_that_intersect(mesh, pairs, steps);
        for (int ring = 0; ring < round / 2; ++ring) grow(mesh, search, moved);
        std::erase_if(moved, [&](std::uint32_t p) { return steps[p] == kAtStart; });
        if (moved.empty()) return ends.size();
        // Triangles are found at the positions before they move.
        const Numbers changed = triangles_with(search, moved);
        for (const std::uint32_t p : moved) {
            const Vec3f to = ends.try_emplace(p, mesh.points[p]).first->second;
            mesh.points[p] = along_path(from[p], to, ++steps[p]);
        }
        pairs = search.find_changed(changed);
    }
}

}  // namespace marrow::internal
