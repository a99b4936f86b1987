// Intersects triangles with exact predicates. Expansions decide the cases where rounding could be wrong.
#include "triangle_intersection.h"

#include <algorithm>
#include <cmath>

#include "base/exact_sum.h"

namespace marrow::internal {

namespace {

// An exact difference of doubles: the rounded difference and its rounding error.
using ExactDifference = std::array<double, 2>;

ExactDifference exact_difference(double x, double y) {
    const double difference = x - y, back = x - difference;
    return {difference, (x - (difference + back)) + (back - y)};
}

int exact_orient3d(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d) {
    std::array<ExactDifference, 3> u, v, w;
    for (std::size_t i = 0; i < 3; ++i) {
        u[i] = exact_difference(b[i], a[i]);
        v[i] = exact_difference(c[i], a[i]);
        w[i] = exact_difference(d[i], a[i]);
    }
    ExactSum determinant;  // of 48 products, with up to four terms each
    for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
        for (const double x : u[i]) {
            for (std::size_t n = 0; n < 4; ++n) {
                determinant.add_product(x, v[j][n / 2], w[k][n % 2]);
                determinant.add_product(-x, v[k][n / 2], w[j][n % 2]);
            }
        }
    }
    return determinant.sign();
}

// A triangle that is rotated so that the apex of its cut comes first.
struct Rotated {
    Vec3d apex, next, last;
    int side = 0;  // of the other triangle's plane on which the apex is
    PlaneCut cut;
};

std::optional<Rotated> rotate_to_apex(const TriangleCorners& s, const std::array<int, 3>& side) {
    for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
        // If one corner is in the plane and the others are on one side of it, the plane cuts only this
        // corner.
        if (side[i] == 0 || side[i] * side[j] > 0 || side[i] * side[k] > 0) continue;
        const std::size_t opposite = side[j] != 0 ? j : side[k] != 0 ? k : PlaneCut::kNone;
        return Rotated{s[i], s[j], s[k], side[i], {i, opposite}};
    }
    return {};
}

std::array<int, 3> sides_of_plane(const TriangleCorners& s, const TriangleCorners& t) {
    return {orient3d(t[0], t[1], t[2], s[0]), orient3d(t[0], t[1], t[2], s[1]),
            orient3d(t[0], t[1], t[2], s[2])};
}

}  // namespace

int orient3d(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d) {
    constexpr double kRounding = 1e-14;  // several times the rounding error of the products and sums below
    const Vec3d u = b - a, v = c - a, w = d - a;
    const double determinant = dot(u, cross(v, w));
    double size = 0;
    for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
        size += std::abs(u[i]) * (std::abs(v[j] * w[k]) + std::abs(v[k] * w[j]));
    }
    if (std::abs(determinant) > kRounding * size) return determinant > 0 ? 1 : -1;
    if (size == 0 || d == a || d == b || d == c) return 0;
    return exact_orient3d(a, b, c, d);
}

// After Devillers and Guigue 2002. Each triangle cuts a segment out of the line that the two planes share.
// The ends of the segment are on the edges apex-next and apex-last. The orientation of two such edges tells
// which end comes first on the line, and so whether the segments overlap.
std::optional<TriangleIntersection> intersect(const TriangleCorners& given_s,
                                              const TriangleCorners& given_t) {
    auto s = rotate_to_apex(given_s, sides_of_plane(given_s, given_t));
    if (!s) return {};
    auto t = rotate_to_apex(given_t, sides_of_plane(given_t, given_s));
    if (!t) return {};
    // Flipping a triangle flips its plane, and so the side on which the other apex is.
    if (s->side < 0) std::swap(t->next, t->last);
    if (t->side < 0) std::swap(s->next, s->last);
    if (orient3d(s->apex, s->next, t->apex, t->next) >= 0 ||
        orient3d(s->apex, s->last, t->apex, t->last) <= 0)
        return {};
    return TriangleIntersection{s->cut, t->cut};
}

bool sheets_cross(const Vec3d& p, const Vec3d& q, const std::array<Vec3d, 2>& a,
                  const std::array<Vec3d, 2>& b) {
    // The sides of the sheet a divide the directions around the line into two sectors. A point is in the
    // sector that follows a[0] (1), in the sector that follows a[1] (-1), or in the direction of a side (0).
    const int turn = orient3d(p, q, a[0], a[1]);
    const auto sector = [&](const Vec3d& point) {
        const int from = orient3d(p, q, a[0], point), to = orient3d(p, q, point, a[1]);
        const bool both_positive = from > 0 && to > 0, both_negative = from < 0 && to < 0;
        if (turn < 0 ? from > 0 || to > 0 : both_positive) return 1;
        return (turn > 0 ? from < 0 || to < 0 : both_negative) ? -1 : 0;
    };
    return sector(b[0]) * sector(b[1]) < 0;
}

}  // namespace marrow::internal
