// Shows for most tunnels by a look from their middle that they have no crossings, and for the others by a
// plane between the triangles of each pair.
#include "tunnel_crossings.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

namespace marrow::internal {

namespace {

using Points = TunnelTriangles::Points;
using Corners = std::array<Vec3d, 3>;

constexpr double kRounding = 1e-13;  // more than the rounding error of a volume in the cell
// Much more, as the points are later rounded to float. Samples of few digits make planes and edges that touch
// exactly, and would pass through each other after that.
constexpr double kApart = 1e-7;

// The planes of the triangles.
struct Planes {
    std::array<Vec3d, TunnelTriangles::kMost> normals;
    std::array<double, TunnelTriangles::kMost> offsets;

    Planes(const TunnelTriangles& triangles, const Points& points) {
        for (std::size_t k = 0; k < triangles.count; ++k) {
            const auto [a, b, c] = triangles.triangle(k);
            normals[k] = cross(points[b] - points[a], points[c] - points[a]);
            offsets[k] = dot(normals[k], points[a]);
        }
    }
    // Six times the volume between a triangle and a point, positive on the side of the normal.
    double height(std::size_t k, const Vec3d& point) const { return dot(normals[k], point) - offsets[k]; }
};

// The corners of a triangle. If one of them is this point, it comes first.
Corners corners_from(const std::array<std::size_t, 3>& triangle, std::size_t first, const Points& points) {
    const auto [a, b, c] = triangle;
    if (b == first) return {points[b], points[c], points[a]};
    if (c == first) return {points[c], points[a], points[b]};
    return {points[a], points[b], points[c]};
}

// Looks at the triangles from a point in the middle of the tunnel.
class View {
  public:
    View(const TunnelTriangles& triangles, const Points& points, const Planes& planes)
        : triangles_(triangles), points_(points), planes_(planes) {
        for (std::size_t i = kCellEdges; i < points.size(); ++i)
            from_ = from_ + 1.0 / CellTopology::kTunnelPoints * points[i];
        double volume = 0;
        for (std::size_t k = 0; k < triangles.count; ++k) volume += planes.height(k, from_);
        side_ = volume < 0 ? -1 : 1;
    }

    // Moves the point in the cell until it is on the same side of all triangles. Says whether that succeeds.
    bool see_one_side_of_all() {
        constexpr int kMoves = 4;  // More hardly ever help.
        for (int move = 0; move <= kMoves; ++move) {
            std::size_t lowest = 0;
            for (std::size_t k = 1; k < triangles_.count; ++k) {
                if (height(k) < height(lowest)) lowest = k;
            }
            if (height(lowest) > kRounding)
                return std::all_of(from_.begin(), from_.end(), [](double x) { return x > 0 && x < 1; });
            // A little further than to the plane.
            const Vec3d& normal = planes_.normals[lowest];
            const double squared = dot(normal, normal);
            const double move_by = (1e-4 * std::sqrt(squared) - 1.2 * height(lowest)) / squared;
            from_ = from_ + side_ * move_by * normal;
        }
        return false;
    }

    // Whether the middle of a triangle's first side is seen, and no other triangle in its direction.
    bool is_alone(std::size_t triangle) const {
        const auto [first, second, third] = triangles_.triangle(triangle);
        const Vec3d ray = 0.5 * (points_[first] + points_[second]) - from_;
        for (std::size_t k = 0; k < triangles_.count; ++k) {
            if (k == triangle) continue;
            const auto [a, b, c] = triangles_.triangle(k);
            const Vec3d u = points_[a] - from_, v = points_[b] - from_, w = points_[c] - from_;
            const auto passes_inside = [&](const Vec3d& p, const Vec3d& q) {
                return side_ * dot(ray, cross(p, q)) < kRounding;
            };
            if (passes_inside(u, v) && passes_inside(v, w) && passes_inside(w, u)) return false;
        }
        return true;
    }

  private:
    double height(std::size_t k) const { return side_ * planes_.height(k, from_); }

    const TunnelTriangles& triangles_;
    const Points& points_;
    const Planes& planes_;
    Vec3d from_{};
    double side_ = 1;
};

// The points of a triangle, and those clearly on either side of its plane: bit i is point i.
struct Sides {
    std::uint32_t own = 0, above = 0, below = 0;

    // Whether the plane has the other triangle on one side, but for a common corner.
    bool separate(const Sides& other) const {
        const std::uint32_t points = other.own & ~own;
        return (points & ~above) == 0 || (points & ~below) == 0;
    }
};

// Whether a plane along a side of each is between two triangles without a common corner.
bool are_apart(const Corners& s, const Corners& t) {
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) {
            const Vec3d normal = cross(s[(i + 1) % 3] - s[i], t[(j + 1) % 3] - t[j]);
            const auto [s_low, s_high] =
                std::minmax({dot(normal, s[0]), dot(normal, s[1]), dot(normal, s[2])});
            const auto [t_low, t_high] =
                std::minmax({dot(normal, t[0]), dot(normal, t[1]), dot(normal, t[2])});
            if (std::max(t_low - s_high, s_low - t_high) > kApart * length(normal)) return true;
        }
    }
    return false;
}

// Whether a plane through the common corner, their first, and a side of each is between two triangles.
bool are_apart_at_corner(const Corners& s, const Corners& t) {
    for (std::size_t i = 1; i < 3; ++i) {
        for (std::size_t j = 1; j < 3; ++j) {
            const Vec3d normal = cross(s[i] - s[0], t[j] - t[0]);
            const auto [low, high] =
                std::minmax({dot(normal, s[3 - i] - s[0]), dot(normal, t[3 - j] - t[0])});
            if (std::min(-low, high) > kApart * length(normal)) return true;
        }
    }
    return false;
}

// Whether all triangles that share no side are apart.
bool are_all_apart(const TunnelTriangles& triangles, const Points& points, const Planes& planes) {
    std::array<Sides, TunnelTriangles::kMost> sides;
    for (std::size_t k = 0; k < triangles.count; ++k) {
        const double apart = kApart * length(planes.normals[k]);
        for (const std::size_t i : triangles.triangle(k)) sides[k].own |= 1u << i;
        for (std::size_t i = 0; i < points.size(); ++i) {
            const double height = planes.height(k, points[i]);
            sides[k].above |= static_cast<std::uint32_t>(height > apart) << i;
            sides[k].below |= static_cast<std::uint32_t>(height < -apart) << i;
        }
        for (std::size_t j = 0; j < k; ++j) {
            const std::uint32_t common = sides[j].own & sides[k].own;
            if (std::popcount(common) >= 2) continue;
            if (sides[j].separate(sides[k]) || sides[k].separate(sides[j])) continue;
            const std::size_t first = static_cast<std::size_t>(std::countr_zero(common));
            const Corners s = corners_from(triangles.triangle(j), first, points),
                          t = corners_from(triangles.triangle(k), first, points);
            if (common == 0 ? !are_apart(s, t) : !are_apart_at_corner(s, t)) return false;
        }
    }
    return true;
}

}  // namespace

// Look at the tunnel from a point in the cell. Its two loops are in the faces, so neither covers any of the
// other. If all triangles turn the same side to the point, the number of triangles in a direction changes
// only across a loop, by one. So if the triangle at a side of a loop is alone there, then one triangle is
// seen in each direction between the loops, and none in the others: no two can meet.
bool have_crossings(const TunnelTriangles& triangles, const Points& points, std::size_t loops) {
    const Planes planes(triangles, points);
    if (loops == 2) {
        View view(triangles, points, planes);
        std::size_t at_loop = 0;  // Its first side is one of the loop.
        while (triangles.triangle(at_loop)[1] >= kCellEdges) ++at_loop;
        if (view.see_one_side_of_all() && view.is_alone(at_loop)) return false;
    }
    return !are_all_apart(triangles, points, planes);
}

}  // namespace marrow::internal
