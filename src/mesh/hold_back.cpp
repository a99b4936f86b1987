// Moves the corners of intersecting triangles back in rounds: by half of their path, three quarters, seven
// eighths, and so on to the start. As rounds go by, their neighbours move back too. If nothing else helps,
// everything ends at the start, which is valid.
#include "hold_back.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>

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

// A mesh whose points move back.
struct Sheet {
    Mesh& mesh;
    const Buffer<std::uint32_t>& numbers;
    std::unique_ptr<SelfIntersections> intersections = {};
    std::vector<TrianglePair> pairs = {};

    void find_all(const Progress& progress, double begin, double end) {
        intersections = std::make_unique<SelfIntersections>(mesh);
        pairs = intersections->find_all(progress, begin, end);
        if (pairs.empty()) intersections.reset();
    }
    void find_changed(const std::vector<std::uint8_t>& moved) {
        std::vector<std::uint32_t> changed;
        for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
            if (has_corner_in(moved, mesh.triangles[t])) changed.push_back(t);
        }
        if (!intersections && !changed.empty()) intersections = std::make_unique<SelfIntersections>(mesh);
        pairs = changed.empty() ? std::vector<TrianglePair>() : intersections->find_changed(changed);
    }
    bool has_corner_in(const std::vector<std::uint8_t>& set, const Triangle& t) const {
        return (set[numbers[t[0]]] | set[numbers[t[1]]] | set[numbers[t[2]]]) != 0;
    }
    void add_corners(const Triangle& t, std::vector<std::uint8_t>& set) const {
        for (const std::uint32_t p : t) set[numbers[p]] = 1;
    }
};

// The corners of the intersecting triangles, except where all are at their starts: it was so at the start.
void add_intersecting(const Sheet& sheet, const std::vector<Steps>& steps, std::vector<std::uint8_t>& set) {
    for (const TrianglePair& pair : sheet.pairs) {
        const bool can_move = std::any_of(pair.begin(), pair.end(), [&](std::uint32_t t) {
            const Triangle& corners = sheet.mesh.triangles[t];
            return std::any_of(corners.begin(), corners.end(),
                               [&](std::uint32_t p) { return steps[sheet.numbers[p]] < kAtStart; });
        });
        if (!can_move) continue;
        for (const std::uint32_t t : pair) sheet.add_corners(sheet.mesh.triangles[t], set);
    }
}

// Adds the neighbours of the points in a set.
void grow(const std::vector<Sheet>& sheets, std::vector<std::uint8_t>& set) {
    const std::vector<std::uint8_t> before = set;
    for (const Sheet& sheet : sheets) {
        for (const Triangle& t : sheet.mesh.triangles) {
            if (sheet.has_corner_in(before, t)) sheet.add_corners(t, set);
        }
    }
}

}  // namespace

std::size_t hold_back(std::span<Mesh> meshes, const std::vector<Buffer<std::uint32_t>>& numbers,
                      const std::function<Positions()>& start, const Progress& progress, double begin,
                      double end) {
    std::vector<Sheet> sheets;
    bool any = false;
    for (std::size_t m = 0; m < meshes.size(); ++m) {
        const auto at = [&](std::size_t done) {
            return std::lerp(begin, end, static_cast<double>(done) / static_cast<double>(meshes.size()));
        };
        sheets.push_back({meshes[m], numbers[m]});
        sheets.back().find_all(progress, at(m), at(m + 1));
        any |= !sheets.back().pairs.empty();
    }
    if (!any) return 0;
    const Positions from = start();
    Positions to;
    std::size_t count = 0;
    for (const Sheet& sheet : sheets) {
        to.push_back(sheet.mesh.points);
        for (const std::uint32_t number : sheet.numbers) count = std::max<std::size_t>(count, number + 1);
    }
    std::vector<Steps> steps(count, 0);
    for (int round = 0;; ++round) {
        std::vector<std::uint8_t> moved(count, 0);
        for (const Sheet& sheet : sheets) add_intersecting(sheet, steps, moved);
        for (int ring = 0; ring < round / 2; ++ring) grow(sheets, moved);
        for (std::size_t n = 0; n < count; ++n) {
            if (steps[n] == kAtStart) moved[n] = 0;
            steps[n] = static_cast<Steps>(steps[n] + moved[n]);
        }
        if (std::count(moved.begin(), moved.end(), 1) == 0) break;
        for (std::size_t m = 0; m < sheets.size(); ++m) {
            const Buffer<std::uint32_t>& number = sheets[m].numbers;
            for (std::size_t p = 0; p < number.size(); ++p) {
                if (moved[number[p]] != 0)
                    meshes[m].points[p] = along_path(from[m][p], to[m][p], steps[number[p]]);
            }
            sheets[m].find_changed(moved);
        }
    }
    return static_cast<std::size_t>(std::count_if(steps.begin(), steps.end(), [](Steps s) { return s > 0; }));
}

std::size_t hold_back(Mesh& mesh, const std::function<Positions()>& start, const Progress& progress,
                      double begin, double end) {
    std::vector<Buffer<std::uint32_t>> numbers(1, Buffer<std::uint32_t>(mesh.points.size()));
    std::iota(numbers[0].begin(), numbers[0].end(), 0u);
    return hold_back({&mesh, 1}, numbers, start, progress, begin, end);
}

}  // namespace marrow::internal
