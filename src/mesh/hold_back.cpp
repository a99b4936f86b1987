// Moves the corners of intersecting triangles back in rounds: by half of their path, three quarters, seven
// eighths, and so on to the start. As rounds go by, their neighbours move back too. If nothing else helps,
// everything ends at the start, which is valid.
#include "hold_back.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

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

// Marks all corners of the triangles that have a marked corner.
void grow(const Mesh& mesh, std::vector<std::uint8_t>& marked) {
    const std::vector<std::uint8_t> before = marked;
    for (const auto& [a, b, c] : mesh.triangles) {
        if ((before[a] | before[b] | before[c]) != 0) marked[a] = marked[b] = marked[c] = 1;
    }
}

}  // namespace

std::size_t hold_back(const Buffer<Vec3f>& start, Mesh& mesh, const Progress& progress, double begin,
                      double end) {
    SelfIntersections intersections(mesh);
    std::vector<TrianglePair> pairs = intersections.find_all(progress, begin, end);
    if (pairs.empty()) return 0;
    const Buffer<Vec3f> wanted = mesh.points;
    std::vector<Steps> steps(mesh.points.size(), 0);
    for (int round = 0; !pairs.empty(); ++round) {
        std::vector<std::uint8_t> marked(mesh.points.size(), 0);
        for (const TrianglePair& pair : pairs) {
            const auto is_at_start = [&](std::uint32_t p) { return steps[p] == kAtStart; };
            const auto all_at_start = [&](std::uint32_t t) {
                return std::all_of(mesh.triangles[t].begin(), mesh.triangles[t].end(), is_at_start);
            };
            if (all_at_start(pair[0]) && all_at_start(pair[1])) continue;  // it was so at the start
            for (const std::uint32_t t : pair) {
                for (const std::uint32_t p : mesh.triangles[t]) marked[p] = 1;
            }
        }
        for (int ring = 0; ring < round / 2; ++ring) grow(mesh, marked);
        for (std::size_t p = 0; p < marked.size(); ++p) {
            if (steps[p] == kAtStart) marked[p] = 0;
            if (marked[p] != 0) mesh.points[p] = along_path(start[p], wanted[p], ++steps[p]);
        }
        std::vector<std::uint32_t> changed;
        for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
            const auto& [a, b, c] = mesh.triangles[t];
            if ((marked[a] | marked[b] | marked[c]) != 0) changed.push_back(t);
        }
        pairs = intersections.find_changed(changed);
    }
    return static_cast<std::size_t>(std::count_if(steps.begin(), steps.end(), [](Steps s) { return s > 0; }));
}

}  // namespace marrow::internal
