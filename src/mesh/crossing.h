/// Whether triangles pass through each other.
#pragma once

#include "vector.h"

namespace marrow::internal {

/// On which side of the plane through a, b, c the place d lies: the sign, or 0 where rounding could decide.
inline int side_of(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d) {
    constexpr double kRounding = 1e-14;  // several times what the products and sums below can lose
    const Vec3d u = b - a, v = c - a, w = d - a;
    const double determinant = dot(u, cross(v, w));
    double size = 0;
    for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
        size += std::abs(u[i]) * (std::abs(v[j] * w[k]) + std::abs(v[k] * w[j]));
    }
    if (std::abs(determinant) <= kRounding * size) return 0;
    return determinant > 0 ? 1 : -1;
}

/// Whether the segment from p to q passes through the inside of a triangle.
inline bool passes_through(const Vec3d& p, const Vec3d& q, const Corners& t) {
    if (side_of(t.a, t.b, t.c, p) * side_of(t.a, t.b, t.c, q) >= 0) return false;
    const int s = side_of(p, q, t.a, t.b);
    return s != 0 && side_of(p, q, t.b, t.c) == s && side_of(p, q, t.c, t.a) == s;
}

/// Whether an edge of one triangle passes through the inside of the other.
inline bool cross_each_other(const Corners& s, const Corners& t) {
    return passes_through(s.a, s.b, t) || passes_through(s.b, s.c, t) || passes_through(s.c, s.a, t) ||
           passes_through(t.a, t.b, s) || passes_through(t.b, t.c, s) || passes_through(t.c, t.a, s);
}

}  // namespace marrow::internal
