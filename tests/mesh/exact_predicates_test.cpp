// The predicates behind marrow check, against CGAL's exact kernel (its part under the LGPL).
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangle_3.h>
#include <CGAL/intersections.h>

#include "mesh/geometry/triangle_intersection.h"

namespace marrow::test {
namespace {

using internal::TriangleCorners;
using Inexact = CGAL::Exact_predicates_inexact_constructions_kernel;
using Exact = CGAL::Exact_predicates_exact_constructions_kernel;

template <class Kernel>
typename Kernel::Point_3 point(const Vec3d& p) {
    return {p[0], p[1], p[2]};
}

template <class Kernel>
typename Kernel::Triangle_3 triangle(const TriangleCorners& t) {
    return {point<Kernel>(t[0]), point<Kernel>(t[1]), point<Kernel>(t[2])};
}

class ExactPredicates : public testing::Test {
  protected:
    double uniform(double from, double to) {
        return std::uniform_real_distribution<double>(from, to)(random);
    }
    // Coordinates are float values, as those of meshes.
    static double rounded(double x) { return static_cast<float>(x); }

    Vec3d in_space() {
        return {rounded(uniform(-100, 100)), rounded(uniform(-100, 100)), rounded(uniform(-100, 100))};
    }
    // On a grid of few samples, where many points are in one plane.
    Vec3d on_grid(int samples) {
        std::uniform_int_distribution<int> index(0, samples - 1);
        return {0.25 * index(random), 0.25 * index(random), 0.25 * index(random)};
    }
    // The point of a plane nearly, and perhaps exactly.
    Vec3d near_plane(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
        const double s = uniform(-1, 2), t = uniform(-1, 2);
        Vec3d p;
        for (std::size_t i = 0; i < 3; ++i) p[i] = rounded(a[i] + s * (b[i] - a[i]) + t * (c[i] - a[i]));
        return p;
    }

    // Returns the sign that both kernels agree on.
    int expect_same_side(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d) {
        const int side = internal::orient3d(a, b, c, d);
        EXPECT_EQ(side, static_cast<int>(CGAL::orientation(point<Inexact>(a), point<Inexact>(b),
                                                           point<Inexact>(c), point<Inexact>(d))));
        return side;
    }

    std::mt19937_64 random{20260101};
};

TEST_F(ExactPredicates, PointsAreOnTheSideOfThePlaneThatCgalFinds) {
    std::array<int, 3> found{};  // how often each sign
    for (int i = 0; i < 100'000 && !HasFailure(); ++i) {
        const Vec3d a = in_space(), b = in_space(), c = in_space();
        ++found[static_cast<std::size_t>(1 + expect_same_side(a, b, c, in_space()))];
        ++found[static_cast<std::size_t>(1 + expect_same_side(a, b, c, near_plane(a, b, c)))];
        ++found[static_cast<std::size_t>(1 +
                                         expect_same_side(on_grid(5), on_grid(5), on_grid(5), on_grid(5)))];
    }
    for (const int count : found) EXPECT_GT(count, 1000);
}

TEST_F(ExactPredicates, TheLastBitDecides) {
    // Points of a tilted plane through the origin, and their neighbours among the floats.
    const Vec3d a{0, 0, 0}, b{1, 0, 1}, c{0, 1, 1};
    for (int i = 0; i < 20'000 && !HasFailure(); ++i) {
        const auto x = static_cast<float>(std::ldexp(uniform(0.5, 1), -10)),
                   y = static_cast<float>(uniform(0.5, 1));
        const float z = x + y;
        for (const float height : {std::nextafter(z, 0.0f), z, std::nextafter(z, 9.0f)})
            expect_same_side(a, b, c, {x, y, height});
    }
    // Far from the origin, where differences lose bits.
    for (int i = 0; i < 20'000 && !HasFailure(); ++i) {
        std::array<Vec3d, 4> p;
        for (Vec3d& q : p)
            q = {rounded(1e6 + uniform(0, 1)), rounded(uniform(0, 1e-3)), rounded(-1e5 + uniform(0, 1))};
        expect_same_side(p[0], p[1], p[2], p[3]);
    }
}

TEST_F(ExactPredicates, TrianglesIntersectAlongTheSegmentsThatCgalFinds) {
    int segments = 0, touching = 0;
    for (int i = 0; i < 30'000 && !HasFailure(); ++i) {
        TriangleCorners s, t;
        for (Vec3d& p : s) p = i % 2 ? on_grid(4) : in_space();
        for (Vec3d& p : t) p = i % 2 ? on_grid(4) : in_space();
        const auto exact_s = triangle<Exact>(s), exact_t = triangle<Exact>(t);
        if (exact_s.is_degenerate() || exact_t.is_degenerate()) continue;
        const auto common = CGAL::intersection(exact_s, exact_t);
        const bool coplanar = CGAL::coplanar(exact_s[0], exact_s[1], exact_s[2], exact_t[0]) &&
                              CGAL::coplanar(exact_s[0], exact_s[1], exact_s[2], exact_t[1]) &&
                              CGAL::coplanar(exact_s[0], exact_s[1], exact_s[2], exact_t[2]);
        const bool segment = !coplanar && common && boost::get<Exact::Segment_3>(&*common);
        EXPECT_EQ(internal::intersect(s, t).has_value(), segment) << i;
        segments += segment;
        touching += common && !segment;
    }
    EXPECT_GT(segments, 1000);
    EXPECT_GT(touching, 1000) << "in a point, or in their common plane";
}

}  // namespace
}  // namespace marrow::test
