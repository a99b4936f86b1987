// Moves the corners of intersecting triangles back in rounds: by half of their path, three quarters, seven
// eighths, and so on to the start. As rounds go by, their neighbours move back too. If nothing else helps,
// everything ends at the start, which is valid.
#include "hold_back.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <unordered_map>
#include <utility>

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
    std::span<const std::uint32_t> numbers;
    std::unique_ptr<SelfIntersections> intersections = {};
    std::vector<TrianglePair> pairs = {};
    std::vector<std::uint32_t> by_number = {};  // the points, in the order of their numbers

    void list_points() {
        by_number.resize(numbers.size());
        std::iota(by_number.begin(), by_number.end(), 0u);
        if (std::is_sorted(numbers.begin(), numbers.end())) return;
        std::sort(by_number.begin(), by_number.end(),
                  [&](std::uint32_t p, std::uint32_t q) { return numbers[p] < numbers[q]; });
    }
    // The points that have a number.
    std::span<const std::uint32_t> points(std::uint32_t number) const {
        const auto begin = std::partition_point(by_number.begin(), by_number.end(),
                                                [&](std::uint32_t p) { return numbers[p] < number; });
        const auto end = std::partition_point(begin, by_number.end(),
                                              [&](std::uint32_t p) { return numbers[p] == number; });
        return {begin, end};
    }
    SelfIntersections& search() {
        if (!intersections) intersections = std::make_unique<SelfIntersections>(mesh);
        return *intersections;
    }
};

using Numbers = std::vector<std::uint32_t>;

void sort_out(Numbers& set) {
    std::sort(set.begin(), set.end());
    set.erase(std::unique(set.begin(), set.end()), set.end());
}

// The corners of the intersecting triangles, except where all are at their starts: it was so at the start.
void add_intersecting(const Sheet& sheet, const std::vector<Steps>& steps, Numbers& set) {
    for (const TrianglePair& pair : sheet.pairs) {
        Numbers corners;
        for (const std::uint32_t t : pair) {
            for (const std::uint32_t p : sheet.mesh.triangles[t]) corners.push_back(sheet.numbers[p]);
        }
        if (std::any_of(corners.begin(), corners.end(), [&](std::uint32_t n) { return steps[n] < kAtStart; }))
            set.insert(set.end(), corners.begin(), corners.end());
    }
}

// The triangles of a sheet with corners in a set.
Numbers triangles_with(Sheet& sheet, const Numbers& set) {
    Numbers triangles;
    for (const std::uint32_t n : set) {
        for (const std::uint32_t p : sheet.points(n)) {
            const Numbers at_point = sheet.search().triangles_at(p);
            triangles.insert(triangles.end(), at_point.begin(), at_point.end());
        }
    }
    sort_out(triangles);
    return triangles;
}

// Adds the neighbours of the points in a set.
void grow(std::vector<Sheet>& sheets, Numbers& set) {
    Numbers grown = set;
    for (Sheet& sheet : sheets) {
        for (const std::uint32_t t : triangles_with(sheet, set)) {
            for (const std::uint32_t p : sheet.mesh.triangles[t]) grown.push_back(sheet.numbers[p]);
        }
    }
    sort_out(grown);
    set = std::move(grown);
}

// Moves points back until the sheets do not pass through themselves. Returns how many points.
std::size_t move_back(std::vector<Sheet>& sheets, const std::function<Positions()>& start) {
    if (std::all_of(sheets.begin(), sheets.end(), [](const Sheet& s) { return s.pairs.empty(); })) return 0;
    const Positions from = start();
    std::size_t count = 0;
    for (const Sheet& sheet : sheets) {
        for (const std::uint32_t number : sheet.numbers)
            count = std::max<std::size_t>(count, number + std::size_t{1});
    }
    for (Sheet& sheet : sheets) sheet.list_points();
    std::vector<Steps> steps(count, 0);
    // The ends of the paths of points that have moved back.
    std::vector<std::unordered_map<std::uint32_t, Vec3f>> ends(sheets.size());
    for (int round = 0;; ++round) {
        Numbers moved;
        for (const Sheet& sheet : sheets) add_intersecting(sheet, steps, moved);
        sort_out(moved);
        for (int ring = 0; ring < round / 2; ++ring) grow(sheets, moved);
        std::erase_if(moved, [&](std::uint32_t n) { return steps[n] == kAtStart; });
        if (moved.empty()) break;
        for (const std::uint32_t n : moved) ++steps[n];
        for (std::size_t m = 0; m < sheets.size(); ++m) {
            Sheet& sheet = sheets[m];
            // Triangles are found at the positions before they move.
            const Numbers changed = triangles_with(sheet, moved);
            for (const std::uint32_t n : moved) {
                for (const std::uint32_t p : sheet.points(n)) {
                    Vec3f& point = sheet.mesh.points[p];
                    const Vec3f end = ends[m].try_emplace(p, point).first->second;
                    point = along_path(from[m][p], end, steps[n]);
                }
            }
            sheet.pairs =
                changed.empty() ? std::vector<TrianglePair>() : sheet.search().find_changed(changed);
        }
    }
    return static_cast<std::size_t>(std::count_if(steps.begin(), steps.end(), [](Steps s) { return s > 0; }));
}

}  // namespace

std::size_t hold_back(std::span<Mesh> meshes, const std::vector<Buffer<std::uint32_t>>& numbers,
                      const std::function<Positions()>& start, const Progress& progress, double begin,
                      double end) {
    std::vector<Sheet> sheets;
    for (std::size_t m = 0; m < meshes.size(); ++m) {
        const auto at = [&](std::size_t done) {
            return std::lerp(begin, end, static_cast<double>(done) / static_cast<double>(meshes.size()));
        };
        Sheet& sheet = sheets.emplace_back(Sheet{meshes[m], numbers[m]});
        SelfIntersections intersections(sheet.mesh);
        sheet.pairs = intersections.find_all(progress, at(m), at(m + 1));
        if (!sheet.pairs.empty())
            sheet.intersections = std::make_unique<SelfIntersections>(std::move(intersections));
    }
    return move_back(sheets, start);
}

std::size_t hold_back(Mesh& mesh, const OneRings& rings, const std::function<Positions()>& start,
                      const Progress& progress, double begin, double end) {
    SelfIntersections intersections(mesh, rings);
    std::vector<TrianglePair> pairs = intersections.find_all(progress, begin, end);
    if (pairs.empty()) return 0;
    std::vector<Sheet> sheets;
    Buffer<std::uint32_t> numbers(mesh.points.size());
    std::iota(numbers.begin(), numbers.end(), 0u);
    sheets.push_back(
        {mesh, numbers, std::make_unique<SelfIntersections>(std::move(intersections)), std::move(pairs)});
    return move_back(sheets, start);
}

}  // namespace marrow::internal
