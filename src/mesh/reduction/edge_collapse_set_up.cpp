// Pairs the half-edges of a mesh, sums the quadrics of its points, and divides them into regions.
#include "edge_collapse.h"

#include <algorithm>
#include <numeric>

#include "point_regions.h"

namespace marrow::internal {

namespace {

// A region has about this many points. The larger it is, the fewer of its edges are at its
// border, which one thread collapses.
constexpr std::size_t kRegionPoints = 32768;
constexpr std::size_t kMostRegions = 1024;

}  // namespace

EdgeCollapse::EdgeCollapse(const Mesh& mesh, double max_error, CollapseGuard* guard)
    : max_squared_error_(max_error * max_error), guard_(guard), alive_(mesh.triangles.size()) {
    parallel_invoke(
        [&] {
            points_.reserve(mesh.points.size());
            for (const Vec3f& p : mesh.points) points_.push_back({.position = p});
        },
        [&] {
            faces_.reserve(mesh.triangles.size());
            for (const Triangle& t : mesh.triangles) faces_.push_back({t, {kNone, kNone, kNone}});
        });
    // Each thread goes over all triangles, and sets up a part of the points. Neighbours have similar numbers,
    // so few triangles concern several threads.
    const auto parts = static_cast<std::size_t>(thread_count());
    const auto for_each_part = [&](void (EdgeCollapse::*set_up)(const PointRange&)) {
        parallel_for(std::size_t{0}, parts, [&](std::size_t i) {
            (this->*set_up)({static_cast<std::uint32_t>(points_.size() * i / parts),
                             static_cast<std::uint32_t>(points_.size() * (i + 1) / parts)});
        });
    };
    for_each_part(&EdgeCollapse::pair_half_edges);
    for_each_part(&EdgeCollapse::fix_points);
    for_each_part(&EdgeCollapse::sum_quadrics);
    divide(mesh);
}

// Assigns the points to regions. Small meshes have region 0 only.
void EdgeCollapse::divide(const Mesh& mesh) {
    std::size_t count = std::min(points_.size() / kRegionPoints, kMostRegions);
    if (count == 1) count = 0;
    std::vector<std::uint32_t> size(count + 1, 0);
    if (count > 0) {
        const Buffer<std::uint16_t> region = divide_points(mesh.points, count);
        parallel_for_ranges(std::size_t{0}, points_.size(), 4096, [&](const auto& range) {
            for (std::size_t p = range.begin(); p < range.end(); ++p) points_[p].region = region[p];
        });
        for (const std::uint16_t r : region) ++size[r];
    }
    regions_.reserve(count + 1);
    for (std::size_t r = 0; r <= count; ++r) regions_.emplace_back(static_cast<std::uint16_t>(r));
    // Each collapse removes a point, so that a region has no more of them than points. Number 0 means none.
    std::uint32_t first_collapse = 1;
    for (std::size_t r = 1; r <= count; ++r) {
        regions_[r].first_collapse = first_collapse;
        regions_[r].log.reserve(size[r]);
        first_collapse += size[r];
    }
    regions_[0].first_collapse = first_collapse;
    parallel_ = count > 0;
}

// Finds the twin of each half-edge in the neighbouring triangle, if its lower point is in the range.
// Half-edges along open and non-manifold edges keep kNone.
void EdgeCollapse::pair_half_edges(const PointRange& range) {
    struct FromLower {  // a half-edge, listed at its lower point
        std::uint32_t higher;
        Half half;
    };
    std::vector<std::uint32_t> start(range.size() + 2, 0);
    const auto for_each_half = [&](auto f) {
        for (Half t = 0; t < faces_.size(); ++t) {
            const auto& [a, b, c] = faces_[t].from;
            const auto visit = [&](std::uint32_t p, std::uint32_t q, Half h) {
                const std::uint32_t lower = std::min(p, q);
                if (range.contains(lower)) f(lower - range.begin, std::max(p, q), h);
            };
            visit(a, b, 4 * t);
            visit(b, c, 4 * t + 1);
            visit(c, a, 4 * t + 2);
        }
    };
    // Counts go two entries further, so that filling leaves the first entry of p in start[p].
    for_each_half([&](std::uint32_t lower, std::uint32_t, Half) { ++start[lower + std::size_t{2}]; });
    std::partial_sum(start.begin(), start.end(), start.begin());
    Buffer<FromLower> sorted(start.back());
    for_each_half([&](std::uint32_t lower, std::uint32_t higher, Half h) {
        sorted[start[lower + std::size_t{1}]++] = {higher, h};
    });
    for (std::size_t p = 0; p < range.size(); ++p) {
        const auto begin = sorted.begin() + static_cast<std::ptrdiff_t>(start[p]);
        const auto end = sorted.begin() + static_cast<std::ptrdiff_t>(start[p + 1]);
        std::sort(begin, end, [](const FromLower& a, const FromLower& b) { return a.higher < b.higher; });
        for (auto at = begin; at != end;) {
            auto after = at;
            while (after != end && after->higher == at->higher) ++after;
            if (after - at == 2 && from(at[0].half) != from(at[1].half)) pair(at[0].half, at[1].half);
            at = after;
        }
    }
}

// Fixes open points: those that have a half-edge without a twin, and those whose
// triangles do not form one closed fan.
void EdgeCollapse::fix_points(const PointRange& range) {
    std::vector<std::uint32_t> triangles_at(range.size(), 0);
    for (Half t = 0; t < faces_.size(); ++t) {
        for (Half h = 4 * t; h < 4 * t + 3; ++h) {
            const bool is_open = twin(h) == kNone;
            if (is_open && range.contains(to(h))) points_[to(h)].open = true;
            const std::uint32_t p = from(h);
            if (!range.contains(p)) continue;
            points_[p].outgoing = h;
            ++triangles_at[p - range.begin];
            if (is_open) points_[p].open = true;
        }
    }
    for (std::uint32_t p = range.begin; p < range.end; ++p) {
        Point& point = points_[p];
        if (point.outgoing == kNone) point.open = true;
        if (!point.open) {
            std::uint32_t in_fan = 0;
            for_each_outgoing(p, [&](Half) { ++in_fan; });
            point.open = in_fan != triangles_at[p - range.begin];
            point.degree = static_cast<std::uint8_t>(std::min<std::uint32_t>(in_fan, kHighDegree));
        }
        point.fixed = point.open;
    }
}

// A point has the planes of its triangles, each with the share of the triangle's area that belongs to it.
void EdgeCollapse::sum_quadrics(const PointRange& range) {
    for (const Face& face : faces_) {
        const auto& [p, q, r] = face.from;
        if (!range.contains(p) && !range.contains(q) && !range.contains(r)) continue;
        const Vec3d normal = cross(position(q) - position(p), position(r) - position(p));
        const double twice_area = length(normal);
        if (twice_area == 0) continue;
        Quadric<float> share;
        share.add_plane((1 / twice_area) * normal, twice_area / 6);
        for (const std::uint32_t corner : face.from) {
            if (range.contains(corner)) points_[corner].quadric += share;
        }
    }
}

}  // namespace marrow::internal
