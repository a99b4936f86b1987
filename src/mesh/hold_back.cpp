// Moves the corners of intersecting triangles back in rounds: by half of their path, three quarters, seven
// eighths, and so on to the start. As rounds go by, their neighbours move back too. If nothing else helps,
// everything ends at the start, which is valid.
//
// All this happens close to the intersections. So it only looks at the triangles there.
#include "hold_back.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "base/parallel.h"
#include "bounds.h"
#include "self_intersections.h"
#include "triangle_tree.h"

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

// Cells of space around intersecting triangles. Those at the border of the grid go on beyond it.
class Region {
  public:
    explicit Region(const Bounds& bounds) : lower_(bounds.lower), inside_(kCells * kCells * kCells) {
        for (std::size_t axis = 0; axis < 3; ++axis)
            scale_ = std::min(scale_, kCells / (bounds.upper[axis] - bounds.lower[axis]));
    }

    // Adds a box and the cells up to `reach` cells further away.
    void add(const Bounds& box, int reach) {
        for_each_cell(box, reach, [&](std::size_t cell) {
            inside_[cell] = true;
            return true;
        });
    }
    bool contains(const Bounds& box) const {
        return for_each_cell(box, 0, [&](std::size_t cell) { return inside_[cell]; });
    }
    bool overlaps(const Bounds& box) const {
        return !for_each_cell(box, 0, [&](std::size_t cell) { return !inside_[cell]; });
    }

  private:
    static constexpr int kCells = 64;  // along each axis

    int cell(std::size_t axis, float x) const {
        const float cell = (x - lower_[axis]) * scale_;
        return cell > 0 ? static_cast<int>(std::min(cell, kCells - 1.0f)) : 0;
    }
    // Calls f for the cells of a box until it returns false. Returns whether it never did.
    template <class F>
    bool for_each_cell(const Bounds& box, int reach, const F& f) const {
        std::array<int, 3> begin, end;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            begin[axis] = std::max(cell(axis, box.lower[axis]) - reach, 0);
            end[axis] = std::min(cell(axis, box.upper[axis]) + reach + 1, kCells);
        }
        for (int z = begin[2]; z < end[2]; ++z) {
            for (int y = begin[1]; y < end[1]; ++y) {
                for (int x = begin[0]; x < end[0]; ++x)
                    if (!f(static_cast<std::size_t>((z * kCells + y) * kCells + x))) return false;
            }
        }
        return true;
    }

    Vec3f lower_;
    float scale_ = std::numeric_limits<float>::max();
    std::vector<bool> inside_;
};
// The triangles of a mesh that overlap a region.
struct Part {
    Numbers numbers;  // ascending
    Buffer<Triangle> triangles;

    Part(const Mesh& mesh, const Region& region) {
        constexpr std::size_t kSection = 8192;
        std::vector<Numbers> sections((mesh.triangles.size() + kSection - 1) / kSection);
        parallel_for(std::size_t{0}, sections.size(), [&](std::size_t section) {
            const std::size_t begin = section * kSection;
            for (std::size_t t = begin; t < std::min(begin + kSection, mesh.triangles.size()); ++t) {
                if (region.overlaps(bounds_of(mesh, mesh.triangles[t])))
                    sections[section].push_back(static_cast<std::uint32_t>(t));
            }
        });
        for (const Numbers& section : sections) numbers.insert(numbers.end(), section.begin(), section.end());
        for (const std::uint32_t t : numbers) triangles.push_back(mesh.triangles[t]);
    }
    std::uint32_t number_of(std::uint32_t triangle) const {
        const auto at = std::lower_bound(numbers.begin(), numbers.end(), triangle);
        return static_cast<std::uint32_t>(at - numbers.begin());
    }
};

// Moves points back that are within a region, as hold_back() does. Needs to know nothing of what is outside, and
// notices if this is not so any more.
class RegionalHoldBack {
  public:
    RegionalHoldBack(Mesh& mesh, std::span<const Vec3f> start, const Region& region)
        : points_(mesh.points),
          start_(start),
          region_(region),
          part_(mesh, region),
          search_(MeshView(mesh.points, part_.triangles)),
          steps_(mesh.points.size(), 0) {}

    // Returns how many points moved back. If points outside of the region matter, it moves none and returns nothing.
    // `pairs` are those of the mesh.
    std::optional<std::size_t> run(std::vector<TrianglePair> pairs) {
        for (TrianglePair& pair : pairs) pair = {part_.number_of(pair[0]), part_.number_of(pair[1])};
        for (int round = 0;; ++round) {
            Numbers moved = corners_that_intersect(pairs);
            for (int ring = 0; ring < round / 2; ++ring) grow(moved);
            std::erase_if(moved, [&](std::uint32_t p) { return steps_[p] == kAtStart; });
            if (moved.empty() && !left_region_) return ends_.size();
            // Triangles are found at the positions before they move.
            const Numbers changed = triangles_with(moved);
            for (const std::uint32_t p : moved) {
                const Vec3f to = ends_.try_emplace(p, points_[p]).first->second;
                points_[p] = along_path(start_[p], to, ++steps_[p]);
            }
            for (const std::uint32_t t : changed)
                stay_within(bounds_of(MeshView(points_, part_.triangles), part_.triangles[t]));
            if (left_region_) {
                for (const auto& [p, end] : ends_) points_[p] = end;
                return {};
            }
            pairs = search_.find_changed(changed);
        }
    }

  private:
    void stay_within(const Bounds& box) { left_region_ = left_region_ || !region_.contains(box); }

    // The corners of the intersecting triangles, except where all are at their starts: it was so at the start.
    Numbers corners_that_intersect(const std::vector<TrianglePair>& pairs) const {
        Numbers points;
        for (const auto& [s, t] : pairs) {
            const auto can_move = [&](std::uint32_t p) { return steps_[p] < kAtStart; };
            const Triangle &a = part_.triangles[s], &b = part_.triangles[t];
            if (std::none_of(a.begin(), a.end(), can_move) && std::none_of(b.begin(), b.end(), can_move))
                continue;
            points.insert(points.end(), a.begin(), a.end());
            points.insert(points.end(), b.begin(), b.end());
        }
        sort_out(points);
        return points;
    }

    // The triangles with corners in a set.
    Numbers triangles_with(const Numbers& points) {
        Numbers triangles;
        for (const std::uint32_t p : points) {
            stay_within({points_[p], points_[p]});
            const Numbers at_point = search_.triangles_at(p);
            triangles.insert(triangles.end(), at_point.begin(), at_point.end());
        }
        sort_out(triangles);
        return triangles;
    }

    // Adds the neighbours of the points in a set.
    void grow(Numbers& points) {
        Numbers grown = points;
        for (const std::uint32_t t : triangles_with(points))
            grown.insert(grown.end(), part_.triangles[t].begin(), part_.triangles[t].end());
        sort_out(grown);
        points = std::move(grown);
    }

    const std::span<Vec3f> points_;
    const std::span<const Vec3f> start_;
    const Region& region_;
    const Part part_;
    SelfIntersections search_;
    std::vector<Steps> steps_;
    std::unordered_map<std::uint32_t, Vec3f> ends_;  // of the paths of points that have moved back
    bool left_region_ = false;
};

}  // namespace

std::size_t hold_back(Mesh& mesh, const OneRings& rings, const std::function<std::span<const Vec3f>()>& start,
                      const Progress& progress, double begin, double end) {
    const std::vector<TrianglePair> pairs = find_self_intersections(mesh, rings, progress, begin, end);
    if (pairs.empty()) return 0;
    const std::span<const Vec3f> from = start();
    const Bounds bounds = bounds_of(mesh.points);
    for (int reach = 2;; reach *= 2) {  // finally, the region is all of space
        Region region(bounds);
        for (const TrianglePair& pair : pairs) {
            for (const std::uint32_t t : pair) {
                region.add(bounds_of(mesh, mesh.triangles[t]), reach);
                region.add(bounds_of(MeshView(from, mesh.triangles), mesh.triangles[t]), reach);
            }
        }
        if (const auto moved = RegionalHoldBack(mesh, from, region).run(pairs)) return *moved;
    }
}

}  // namespace marrow::internal
