// Places points inside cells.
#include "inner_points.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "core/grid/index_to_physical.h"

namespace marrow::internal {

namespace {

constexpr double kLeast = static_cast<double>(kLeastFraction);

// The largest loop is the one that became a fan.
Vec3d middle_of_fan(const CellShape& shape, const CellValues& f) {
    std::span<const std::uint8_t> loop = shape.loop(0);
    for (std::size_t k = 1; k < shape.loops; ++k) {
        if (shape.loop(k).size() > loop.size()) loop = shape.loop(k);
    }
    Vec3d middle{};
    for (const std::uint8_t edge : loop)
        middle = middle + 1 / static_cast<double>(loop.size()) * edge_point(f, edge);
    for (int step = 0; step < 2; ++step) {
        const Interpolant here(f, middle);
        const double squared = dot(here.gradient, here.gradient);
        const Vec3d next = middle - here.value / squared * here.gradient;
        if (!std::isfinite(next[0] + next[1] + next[2])) break;  // no gradient, or a sample is not finite
        for (std::size_t a = 0; a < 3; ++a) middle[a] = std::clamp(next[a], 0.05, 0.95);
    }
    return middle;
}

// Where the slices across an axis have a cross: at the smaller and at the larger root of their determinant.
// Both are in the cell, and apart even if rounding or a tie would make them one.
std::array<double, 2> cross_slices(const OppositeFaces& s) {
    const double d0 = std::abs(s.d0()), d1 = std::abs(s.d1()), mixed = std::abs(s.mixed());
    const double root = std::sqrt(std::max(0.0, mixed * mixed - 4 * d0 * d1)), sum = mixed + root;
    const auto within = [](double t) { return std::isnan(t) ? 0.5 : std::clamp(t, kLeast, 1 - kLeast); };
    const double low = within(2 * d0 / (2 * d0 + sum)), high = within(sum / (sum + 2 * d1));
    if (high - low >= 2 * kLeast) return {low, high};
    const double middle = std::clamp((low + high) / 2, 2 * kLeast, 1 - 2 * kLeast);
    return {middle - kLeast, middle + kLeast};
}

std::array<Vec3d, CellTopology::kTunnelPoints> tunnel_points(const CellTopology::Tunnel& tunnel,
                                                             const CellValues& f) {
    // The roots of each axis as those of the quadratic formula with - and with + before its square root.
    std::array<std::array<double, 2>, 3> t;
    for (unsigned axis = 0; axis < 3; ++axis) {
        t[axis] = cross_slices(OppositeFaces(f, axis));
        if ((tunnel.positive_faces >> axis & 1) == 0) std::swap(t[axis][0], t[axis][1]);
    }
    const auto& [u, v, w] = t;
    return {{{u[1], v[0], w[0]},
             {u[1], v[0], w[1]},
             {u[0], v[0], w[1]},
             {u[0], v[1], w[1]},
             {u[0], v[1], w[0]},
             {u[1], v[1], w[0]}}};
}

}  // namespace

Vec3d edge_point(const CellValues& f, std::size_t edge) {
    const std::size_t first = kEdgeCorners[edge][0], second = kEdgeCorners[edge][1];
    Vec3d at{static_cast<double>(first & 1), static_cast<double>(first >> 1 & 1),
             static_cast<double>(first >> 2)};
    const std::size_t axis = second - first == 1 ? 0 : second - first == 2 ? 1 : 2;
    const double t = f[first] / (f[first] - f[second]);
    at[axis] = std::isnan(t) ? 0.5 : std::clamp(t, kLeast, 1 - kLeast);
    return at;
}

Interpolant::Interpolant(const CellValues& f, const Vec3d& at) {
    const auto mix = [](double a, double b, double t) { return a + t * (b - a); };
    const double x = at[0], y = at[1], z = at[2];
    // The values on the four edges along x, then on the two lines across them.
    const double f00 = mix(f[0], f[1], x), f10 = mix(f[2], f[3], x), f01 = mix(f[4], f[5], x),
                 f11 = mix(f[6], f[7], x);
    value = mix(mix(f00, f10, y), mix(f01, f11, y), z);
    gradient = {mix(mix(f[1] - f[0], f[3] - f[2], y), mix(f[5] - f[4], f[7] - f[6], y), z),
                mix(f10 - f00, f11 - f01, z), mix(f01, f11, y) - mix(f00, f10, y)};
}

int place_inner_points(const CellTopology& topology, const CellValues& values,
                       std::array<Vec3d, CellTopology::kTunnelPoints>& points) {
    const CellValues f = well_scaled(values);
    if (topology.has_tunnel())
        points = tunnel_points(topology.tunnel, f);
    else if (topology.shape().has_fan)
        points[0] = middle_of_fan(topology.shape(), f);
    return topology.inner_points;
}

}  // namespace marrow::internal
