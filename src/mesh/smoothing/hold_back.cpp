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
#include <numeric>
#include <optional>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "base/progress.h"
#include "mesh/geometry/bounds.h"
#include "mesh/intersections/self_intersections.h"
#include "mesh/intersections/triangle_blocks.h"
#include "mesh/search/triangle_tree.h"

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

// Blocks around intersecting triangles. Those at the border of the grid go on beyond it.
class Region {
  public:
    explicit Region(const BlockGrid& grid) : grid_(grid), wanted_(grid.padded_size()) {
        std::fill(wanted_.begin(), wanted_.end(), std::uint8_t{0});
    }

    // Adds a box and the blocks up to `reach` blocks further away.
    void add(const Bounds& box, std::uint32_t reach) {
        for_each_block(box, reach, [&](std::size_t block) {
            wanted_[block] = 1;
            return true;
        });
    }
    bool contains(const Bounds& box) const {
        return for_each_block(box, 0, [&](std::size_t block) { return wanted_[block] != 0; });
    }
    const Buffer<std::uint8_t>& wanted() const { return wanted_; }

  private:
    // Calls f for the blocks of a box until it returns false. Returns whether it never did.
    template <class F>
    bool for_each_block(const Bounds& box, std::uint32_t reach, const F& f) const {
        std::array<std::uint32_t, 3> first, last, block;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto at = [&](float x) {
                return grid_.half_block(axis, std::clamp(x, grid_.lower[axis], grid_.upper[axis])) / 2;
            };
            first[axis] = at(box.lower[axis]) - std::min(at(box.lower[axis]), reach);
            last[axis] = std::min(at(box.upper[axis]) + reach, grid_.blocks[axis] - 1);
        }
        for (block[2] = first[2]; block[2] <= last[2]; ++block[2]) {
            for (block[1] = first[1]; block[1] <= last[1]; ++block[1]) {
                for (block[0] = first[0]; block[0] <= last[0]; ++block[0])
                    if (!f(grid_.index(block))) return false;
            }
        }
        return true;
    }

    const BlockGrid& grid_;
    Buffer<std::uint8_t> wanted_;
};

// Moves points back along their paths. Knows only some triangles of the mesh: those in a
// region, or all if there is no region.
class Retreat {
  public:
    // `numbers` are those of the triangles, in ascending order.
    Retreat(Mesh& mesh, std::span<const Vec3f> start, Buffer<std::uint32_t> numbers, const Region* region)
        : points_(mesh.points),
          start_(start),
          region_(region),
          numbers_(std::move(numbers)),
          triangles_(numbers_.size()),
          steps_(mesh.points.size(), 0) {
        std::transform(numbers_.begin(), numbers_.end(), triangles_.begin(),
                       [&](std::uint32_t t) { return mesh.triangles[t]; });
        search_.emplace(MeshView(points_, triangles_));
    }

    // Returns how many points are no longer where they were. If it would have to know triangles outside of
    // the region, it moves none and returns nothing. `pairs` are those of the mesh. Reports `fraction` in
    // each round.
    std::optional<std::size_t> run(std::vector<TrianglePair> pairs, const Progress& progress,
                                   double fraction) {
        for (TrianglePair& pair : pairs) pair = {index_of(pair[0]), index_of(pair[1])};
        for (int round = 0;; ++round) {
            report_progress(progress, fraction);
            Numbers moved = corners_that_intersect(pairs);
            for (int ring = 0; ring < round / 2; ++ring) grow(moved);
            if (left_region_) return undo();
            std::erase_if(moved, [&](std::uint32_t p) { return steps_[p] == kAtStart; });
            if (moved.empty())
                return std::count_if(ends_.begin(), ends_.end(),
                                     [&](const auto& end) { return points_[end.first] != end.second; });
            // Triangles are found at the positions before they move.
            const Numbers changed = triangles_with(moved);
            for (const std::uint32_t p : moved) {
                const Vec3f to = ends_.try_emplace(p, points_[p]).first->second;
                points_[p] = along_path(start_[p], to, ++steps_[p]);
            }
            for (const std::uint32_t t : changed)
                left_region_ |= is_outside(bounds_of(MeshView(points_, triangles_), triangles_[t]));
            if (left_region_) return undo();
            pairs = search_->find_changed(changed);
        }
    }

  private:
    std::uint32_t index_of(std::uint32_t triangle) const {
        const auto at = std::lower_bound(numbers_.begin(), numbers_.end(), triangle);
        return static_cast<std::uint32_t>(at - numbers_.begin());
    }
    bool is_outside(const Bounds& box) const { return region_ && !region_->contains(box); }
    std::nullopt_t undo() {
        for (const auto& [p, end] : ends_) points_[p] = end;
        return std::nullopt;
    }

    // The corners of the intersecting triangles, except where all are at their
    // starts: it was so at the start.
    Numbers corners_that_intersect(const std::vector<TrianglePair>& pairs) const {
        Numbers points;
        for (const auto& [s, t] : pairs) {
            const auto can_move = [&](std::uint32_t p) { return steps_[p] < kAtStart; };
            const Triangle &a = triangles_[s], &b = triangles_[t];
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
            left_region_ |= is_outside({points_[p], points_[p]});
            const Numbers at_point = search_->triangles_at(p);
            triangles.insert(triangles.end(), at_point.begin(), at_point.end());
        }
        sort_out(triangles);
        return triangles;
    }

    // Adds the neighbours of the points in a set.
    void grow(Numbers& points) {
        Numbers grown = points;
        for (const std::uint32_t t : triangles_with(points))
            grown.insert(grown.end(), triangles_[t].begin(), triangles_[t].end());
        sort_out(grown);
        points = std::move(grown);
    }

    const std::span<Vec3f> points_;
    const std::span<const Vec3f> start_;
    const Region* const region_;
    const Buffer<std::uint32_t> numbers_;
    Buffer<Triangle> triangles_;
    std::optional<SelfIntersections> search_;
    std::vector<Steps> steps_;
    std::unordered_map<std::uint32_t, Vec3f> ends_;  // of the paths of points that have moved back
    bool left_region_ = false;
};

}  // namespace

std::size_t hold_back(Mesh& mesh, const OneRings& rings, const std::function<std::span<const Vec3f>()>& start,
                      const Progress& progress, double begin, double end) {
    const std::optional<TriangleBlocks> blocks = find_triangle_blocks(mesh, rings);
    const std::vector<TrianglePair> pairs =
        find_self_intersections(mesh, rings, blocks, progress, begin, end);
    if (pairs.empty()) return 0;
    const std::span<const Vec3f> from = start();
    if (blocks) {
        constexpr std::uint32_t kReach = 4;  // blocks, each as wide as one and a half edges
        Region region(blocks->grid);
        for (const TrianglePair& pair : pairs) {
            for (const std::uint32_t t : pair) {
                region.add(bounds_of(mesh, mesh.triangles[t]), kReach);
                region.add(bounds_of(MeshView(from, mesh.triangles), mesh.triangles[t]), kReach);
            }
        }
        Retreat retreat(mesh, from, triangles_in(*blocks, region.wanted()), &region);
        if (const std::optional<std::size_t> moved = retreat.run(pairs, progress, end)) return *moved;
    }
    Buffer<std::uint32_t> all(mesh.triangles.size());
    std::iota(all.begin(), all.end(), std::uint32_t{0});
    return Retreat(mesh, from, std::move(all), nullptr).run(pairs, progress, end).value();
}

}  // namespace marrow::internal
