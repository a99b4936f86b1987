// Pairs the half-edges of a mesh, sums the quadrics of its points, and divides them into regions.
#include "edge_collapse.h"

#include <algorithm>
#include <numeric>

#include "mesh/geometry/triangle_corners.h"
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
    const PointBands bands(mesh);
    pair_half_edges(mesh, bands);
    fix_points(mesh, bands);
    sum_quadrics(mesh, bands);
    divide(mesh);
}

// Assigns the points to regions. Small meshes have region 0 only.
void EdgeCollapse::divide(const Mesh& mesh) {
    std::size_t count = std::min(points_.size() / kRegionPoints, kMostRegions);
    if (count == 1) count = 0;
    std::vector<std::uint32_t> size(count + 1, 0);
    if (count > 0) {
        const Buffer<std::uint16_t> region = divide_points(mesh, count);
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

// Finds the twin of each half-edge in the neighbouring triangle. Half-edges along open and non-manifold edges
// keep kNone.
void EdgeCollapse::pair_half_edges(const MeshView& mesh, const PointBands& bands) {
    struct FromLower {  // a half-edge, listed at its lower point
        std::uint32_t higher;
        Half half;
    };
    struct Lists {
        std::vector<std::uint32_t> start;
        Buffer<FromLower> sorted;
    };
    PerThread<Lists> lists;
    bands.for_each([&](const PointBands::Band& band) {
        std::vector<std::uint32_t>& start = lists.local().start;
        Buffer<FromLower>& sorted = lists.local().sorted;
        const auto for_each_half = [&](const auto& f) {
            bands.for_each_triangle(band, [&](std::size_t t, const auto& is_inside) {
                const auto& [a, b, c] = mesh.triangles[t];
                const auto first = static_cast<Half>(4 * t);
                const auto visit = [&](std::uint32_t p, std::uint32_t q, Half h) {
                    const std::uint32_t lower = std::min(p, q);
                    if (is_inside(lower)) f(lower - band.begin, std::max(p, q), h);
                };
                visit(a, b, first);
                visit(b, c, first + 1);
                visit(c, a, first + 2);
            });
        };
        // Counts go two entries further, so that filling leaves the first entry of p in start[p].
        start.assign(band.size() + 2, 0);
        for_each_half([&](std::size_t lower, std::uint32_t, Half) { ++start[lower + 2]; });
        std::partial_sum(start.begin(), start.end(), start.begin());
        sorted.resize(std::max<std::size_t>(sorted.size(), start.back()));
        for_each_half([&](std::size_t lower, std::uint32_t higher, Half h) {
            sorted[start[lower + 1]++] = {higher, h};
        });
        for (std::size_t p = 0; p < band.size(); ++p) {
            FromLower* const begin = sorted.data() + start[p];
            FromLower* const end = sorted.data() + start[p + 1];
            std::sort(begin, end, [](const FromLower& a, const FromLower& b) { return a.higher < b.higher; });
            for (FromLower* at = begin; at != end;) {
                FromLower* after = at;
                while (after != end && after->higher == at->higher) ++after;
                if (after - at == 2 && from(at[0].half) != from(at[1].half)) pair(at[0].half, at[1].half);
                at = after;
            }
        }
    });
}

// Fixes open points: those that have a half-edge without a twin, and those whose triangles do not form one
// closed fan.
void EdgeCollapse::fix_points(const MeshView& mesh, const PointBands& bands) {
    Buffer<std::uint32_t> triangles_at(points_.size());
    bands.for_each([&](const PointBands::Band& band) {
        std::fill_n(triangles_at.data() + band.begin, band.size(), 0u);
        bands.for_each_triangle(band, [&](std::size_t t, const auto& is_inside) {
            for (std::size_t k = 0; k < 3; ++k) {
                const auto h = static_cast<Half>(4 * t + k);
                const bool is_open = twin(h) == kNone;
                const std::uint32_t p = mesh.triangles[t][k], q = mesh.triangles[t][(k + 1) % 3];
                if (is_open && is_inside(q)) points_[q].open = true;
                if (!is_inside(p)) continue;
                points_[p].outgoing = h;
                ++triangles_at[p];
                if (is_open) points_[p].open = true;
            }
        });
        for (std::size_t i = band.begin; i < band.end; ++i) {
            Point& point = points_[i];
            if (point.outgoing == kNone) point.open = true;
            if (!point.open) {
                std::uint32_t in_fan = 0;
                for_each_outgoing(static_cast<std::uint32_t>(i), [&](Half) { ++in_fan; });
                point.open = in_fan != triangles_at[i];
                point.degree = static_cast<std::uint8_t>(std::min<std::uint32_t>(in_fan, kHighDegree));
            }
            point.fixed = point.open;
        }
    });
}

// A point has the planes of its triangles, each with the share of the triangle's area that belongs to it.
void EdgeCollapse::sum_quadrics(const MeshView& mesh, const PointBands& bands) {
    bands.for_each([&](const PointBands::Band& band) {
        bands.for_each_triangle(band, [&](std::size_t t, const auto& is_inside) {
            const Triangle& corners = mesh.triangles[t];
            if (std::none_of(corners.begin(), corners.end(), is_inside)) return;
            const auto [p, q, r] = corners_of(mesh, corners);
            const Vec3d normal = cross(q - p, r - p);
            const double twice_area = length(normal);
            if (twice_area == 0) return;
            Quadric<float> share;
            share.add_plane((1 / twice_area) * normal, twice_area / 6);
            for (const std::uint32_t corner : corners) {
                if (is_inside(corner)) points_[corner].quadric += share;
            }
        });
    });
}

}  // namespace marrow::internal
