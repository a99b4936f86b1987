// Tests angles, curvature, roughness and distances with known shapes, and the tree that finds nearest
// triangles.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>

#include <marrow/error.h>
#include <marrow/isosurface.h>
#include <marrow/measure.h>

#include "mesh/geometry/bounds.h"
#include "mesh/geometry/triangle_corners.h"
#include "mesh/search/distance.h"
#include "mesh/search/triangle_distance.h"
#include "mesh/search/triangle_tree.h"
#include "support/fields.h"

namespace marrow {
namespace {

using std::numbers::pi;

Vec3f point(double x, double y, double z) {
    return {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
}

Mesh one_triangle(const Vec3f& a, const Vec3f& b, const Vec3f& c) {
    Mesh mesh;
    mesh.points = {a, b, c};
    mesh.triangles = {{0, 1, 2}};
    return mesh;
}

// A square sheet from -half to half with n^2 squares at height(x, y).
template <class F>
Mesh sheet(double half, std::uint32_t n, const F& height) {
    Mesh mesh;
    for (std::uint32_t j = 0; j <= n; ++j) {
        for (std::uint32_t i = 0; i <= n; ++i) {
            const double x = half * (2.0 * i / n - 1), y = half * (2.0 * j / n - 1);
            mesh.points.push_back(point(x, y, height(x, y)));
        }
    }
    for (std::uint32_t j = 0; j < n; ++j) {
        for (std::uint32_t i = 0; i < n; ++i) {
            const std::uint32_t a = j * (n + 1) + i, b = a + 1, c = a + n + 1, d = c + 1;
            mesh.triangles.push_back({a, b, d});
            mesh.triangles.push_back({a, d, c});
        }
    }
    return mesh;
}

// An octahedron whose triangles are split in four `splits` times. Every point is at radius(direction).
template <class F>
Mesh split_sphere(int splits, const F& radius) {
    Mesh mesh;
    mesh.points = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    for (int split = 0; split < splits; ++split) {
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
        const auto middle = [&](std::uint32_t a, std::uint32_t b) {
            const auto [at, added] = middles.try_emplace(std::minmax(a, b), mesh.points.size());
            if (added) {
                const Vec3f p = mesh.points[a], q = mesh.points[b];
                const double s = std::hypot(p[0] + q[0], p[1] + q[1], p[2] + q[2]);
                mesh.points.push_back(point((p[0] + q[0]) / s, (p[1] + q[1]) / s, (p[2] + q[2]) / s));
            }
            return at->second;
        };
        Buffer<Triangle> finer;
        for (const auto& [a, b, c] : mesh.triangles) {
            const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
            for (const Triangle& t : {Triangle{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}})
                finer.push_back(t);
        }
        mesh.triangles = finer;
    }
    for (Vec3f& p : mesh.points) {
        const double r = radius(p);
        p = point(r * p[0], r * p[1], r * p[2]);
    }
    return mesh;
}

Mesh sphere(int splits, double r) {
    return split_sphere(splits, [r](const Vec3f&) { return r; });
}

Mesh moved(Mesh mesh, const Vec3f& by) {
    for (Vec3f& p : mesh.points) {
        for (std::size_t axis = 0; axis < 3; ++axis) p[axis] += by[axis];
    }
    return mesh;
}

// ---- Triangles ----

TEST(TriangleQuality, MeasuresEquilateralAndRightTriangles) {
    const auto equilateral = triangle_quality(one_triangle({0, 0, 0}, {2, 0, 0}, point(1, std::sqrt(3), 0)));
    EXPECT_NEAR(equilateral.smallest_angle, 60, 1e-5);
    EXPECT_NEAR(equilateral.largest_aspect_ratio, 1, 1e-6);

    const auto right = triangle_quality(one_triangle({5, 5, 5}, {5, 6, 5}, {5, 5, 6}));
    EXPECT_NEAR(right.smallest_angle, 45, 1e-9);
    EXPECT_NEAR(right.median_aspect_ratio, std::sqrt(2) * (2 + std::sqrt(2)) / (2 * std::sqrt(3)), 1e-9);
    EXPECT_EQ(right.angle_histogram[9], 1) << "90 degrees";
    EXPECT_EQ(right.angle_histogram[4], 2);
    EXPECT_EQ(right.triangles_without_area, 0);
}

TEST(TriangleQuality, TakesTheMeanOfTheTwoInTheMiddle) {
    Mesh two = one_triangle({0, 0, 0}, {2, 0, 0}, point(1, std::sqrt(3), 0));
    const double right = triangle_quality(one_triangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0})).median_aspect_ratio;
    two.points.push_back({0, 2, 0});
    two.triangles.push_back({0, 1, 3});
    EXPECT_NEAR(triangle_quality(two).median_aspect_ratio, (1 + right) / 2, 1e-6);
}

TEST(TriangleQuality, CountsTrianglesWithoutArea) {
    Mesh mesh = one_triangle({0, 0, 0}, {1, 0, 0}, {3, 0, 0});  // angles of 0, 180 and 0 degrees
    mesh.triangles.push_back({0, 0, 1});                        // equal indices
    const auto quality = triangle_quality(mesh);
    EXPECT_EQ(quality.triangles_without_area, 2);
    EXPECT_EQ(quality.smallest_angle, 0);
    EXPECT_EQ(quality.largest_aspect_ratio, std::numeric_limits<double>::infinity());
    EXPECT_EQ(quality.angle_histogram[17], 1);
    EXPECT_EQ(std::accumulate(quality.angle_histogram.begin(), quality.angle_histogram.end(), 0), 6);
}

TEST(TriangleQuality, FindsTheSliversOfAnExtraction) {
    // Samples just above the isovalue have points very near them, so triangles become slivers.
    const Volume volume = test::sampled<float>(test::grid(6, 6, 6), [](auto x, auto y, auto z) {
        return x == 0 || y == 0 || z == 0 || x == 5 || y == 5 || z == 5 ? -1.0 : 1e-6;
    });
    const auto sharp = triangle_quality(extract_isosurface(volume, 0));
    EXPECT_LT(sharp.smallest_angle, 0.1);
    EXPECT_GT(sharp.largest_aspect_ratio, 100);
}

TEST(TriangleQuality, IsZeroWithoutTrianglesAndRejectsInvalidIndices) {
    EXPECT_EQ(triangle_quality({}).smallest_angle, 0);
    Mesh broken = one_triangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
    broken.triangles[0][2] = 3;
    EXPECT_THROW(triangle_quality(broken), InputError);
    EXPECT_THROW(mean_curvature(broken), InputError);
    EXPECT_THROW(roughness(broken, 1), InputError);
    EXPECT_THROW(mesh_distance(broken, broken), InputError);
}

// ---- Curvature and roughness ----

TEST(MeanCurvature, OfASphereIsOneOverItsRadius) {
    for (const double radius : {0.5, 20.0}) {
        const Mesh mesh = sphere(5, radius);
        for (const double h : mean_curvature(mesh)) EXPECT_NEAR(h * radius, 1, 0.01);
        EXPECT_NEAR(roughness(mesh, radius / 4).mean_curvature * radius, 1, 0.01);
        EXPECT_LT(roughness(mesh, radius / 4).roughness * radius, 0.005);
    }
}

TEST(MeanCurvature, IsNegativeInAHollow) {
    Mesh hollow = sphere(4, 3);
    for (Triangle& t : hollow.triangles) std::swap(t[1], t[2]);
    for (const double h : mean_curvature(hollow)) EXPECT_NEAR(h, -1.0 / 3, 0.01);
}

TEST(MeanCurvature, OfAnExtractedSphereIsRightOnAverage) {
    // Marching cubes makes irregular triangles. Their curvature is wrong at single points, but not its mean
    // over a window.
    const double radius = 24;
    const Volume ball =
        test::sampled_in_space<float>(test::grid(56, 56, 56), test::sphere({27.3, 27.6, 27.1}, radius));
    EXPECT_NEAR(roughness(extract_isosurface(ball, 0), 5).mean_curvature * radius, 1, 0.1);
}

// Two closed fans at a point are not one.
TEST(Curvature, HasNoValueWhereTwoBodiesTouch) {
    Mesh mesh;
    mesh.points = {{0, 0, 0}};
    for (const float side : {-1.0f, 1.0f}) {
        const auto first = static_cast<std::uint32_t>(mesh.points.size());
        for (const Vec3f& p : {Vec3f{1, 0, 0}, {1, 1, 0}, {1, 0, 1}})
            mesh.points.push_back({side * p[0], side * p[1], side * p[2]});
        const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
            mesh.triangles.push_back(side > 0 ? Triangle{a, b, c} : Triangle{a, c, b});
        };
        add(0, first + 1, first);
        add(0, first + 2, first + 1);
        add(0, first, first + 2);
        add(first, first + 1, first + 2);
    }
    const std::vector<double> h = mean_curvature(mesh);
    EXPECT_TRUE(std::isnan(h[0]));
    for (std::size_t p = 1; p < h.size(); ++p) EXPECT_FALSE(std::isnan(h[p])) << p;
}

TEST(MeanCurvature, OfAPlaneIsZeroAndOfItsBorderNaN) {
    constexpr std::uint32_t kCells = 12;
    const Mesh plane = sheet(3, kCells, [](double, double) { return 1.0; });
    const auto h = mean_curvature(plane);
    std::size_t at = 0;
    for (std::uint32_t j = 0; j <= kCells; ++j) {
        for (std::uint32_t i = 0; i <= kCells; ++i, ++at) {
            const bool border = i == 0 || j == 0 || i == kCells || j == kCells;
            if (border)
                EXPECT_TRUE(std::isnan(h[at]));
            else
                EXPECT_EQ(h[at], 0);
        }
    }
    const Roughness flat = roughness(plane, 1);
    EXPECT_EQ(flat.roughness, 0);
    EXPECT_EQ(flat.points, (kCells - 1) * (kCells - 1));
}

TEST(Roughness, OfARippleFollowsTheFormula) {
    // z = a sin(kx) has H = -z'' / 2 = a k^2 sin(kx) / 2 for small slopes. The mean of H over a disc of
    // radius w is 2 J1(kw) / (kw) times H. The mean of |sin| is 2 / pi.
    const double k = 2 * pi / 4, window = 1;
    const double in_window = 2 * std::cyl_bessel_j(1, k * window) / (k * window);
    for (const double a : {0.01, 0.02}) {
        const Mesh ripple = sheet(10, 200, [&](double x, double) { return a * std::sin(k * x); });
        const double expected = a * k * k / 2 * (1 - in_window) * 2 / pi;
        EXPECT_NEAR(roughness(ripple, window).roughness / expected, 1, 0.05);
    }
}

TEST(Roughness, DoesNotDependOnTheDensityOfTheMesh) {
    const auto bumpy = [](const Vec3f& n) {
        return 10 + 0.1 * std::sin(12 * n[0]) * std::sin(12 * n[1]) * std::sin(12 * n[2]);
    };
    const double coarse = roughness(split_sphere(5, bumpy), 2).roughness;
    const double fine = roughness(split_sphere(6, bumpy), 2).roughness;
    EXPECT_NEAR(fine / coarse, 1, 0.1);
    EXPECT_GT(coarse, 20 * roughness(sphere(5, 10), 2).roughness);
}

TEST(Roughness, DoesNotMixNearbySheets) {
    const auto wave = [](double x, double) { return 0.05 * std::sin(3 * x); };
    const Mesh one = sheet(3, 60, wave);
    Mesh two = one;
    for (const Vec3f& p : one.points) two.points.push_back(point(p[0], p[1], 0.1 - p[2]));
    const auto shift = static_cast<std::uint32_t>(one.points.size());
    for (const Triangle& t : one.triangles)
        two.triangles.push_back({t[0] + shift, t[2] + shift, t[1] + shift});
    EXPECT_NEAR(roughness(two, 0.5).roughness / roughness(one, 0.5).roughness, 1, 1e-5);
    EXPECT_THROW(roughness(one, 0), InputError);
}

// ---- Distance ----

TEST(MeshDistance, BetweenParallelPlanesIsTheirGap) {
    const Mesh lower = sheet(5, 3, [](double, double) { return 0.0; });
    const Mesh upper = sheet(5, 7, [](double, double) { return 0.75; });
    const MeshDistance d = mesh_distance(lower, upper, {.samples = 1000});
    EXPECT_NEAR(d.mean, 0.75, 1e-12);
    EXPECT_NEAR(d.max, 0.75, 1e-12);
    EXPECT_EQ(mesh_distance(lower, lower).max, 0);
}

TEST(MeshDistance, BetweenConcentricSpheresIsTheDifferenceOfRadii) {
    const MeshDistance d = mesh_distance(sphere(5, 10), sphere(5, 11.5), {.samples = 20000});
    EXPECT_NEAR(d.mean, 1.5, 0.02);
    EXPECT_NEAR(d.max, 1.5, 0.02);
}

TEST(MeshDistance, OfAMovedSphereHasHalfTheMoveAsMeanAndTheMoveAsMaximum) {
    // To first order, | |x + d| - r | is |d cos|. The mean of |cos| over a sphere is 1/2.
    const Mesh ball = sphere(6, 10);
    const MeshDistance d = mesh_distance(ball, moved(ball, {0.3f, 0, 0}));
    EXPECT_NEAR(d.mean, 0.15, 0.005);
    EXPECT_NEAR(d.max, 0.3, 0.005);
}

TEST(MeshDistance, IsSymmetricAlsoIfOneMeshIsLarger) {
    const Mesh small = sheet(1, 4, [](double, double) { return 0.0; });
    const Mesh large = sheet(4, 4, [](double, double) { return 0.0; });
    const MeshDistance there = mesh_distance(small, large), back = mesh_distance(large, small);
    EXPECT_NEAR(there.max, 3 * std::sqrt(2), 1e-6) << "the corner of the large sheet";
    EXPECT_EQ(there.max, back.max);
    EXPECT_EQ(there.mean, back.mean);
}

// The distance from p to a triangle by definition: the minimum over a fine grid of positions in the triangle.
double distance_by_grid(const Vec3f& p, const Mesh& mesh, const Triangle& t) {
    constexpr int kSteps = 64;
    double nearest = std::numeric_limits<double>::infinity();
    for (int i = 0; i <= kSteps; ++i) {
        for (int j = 0; i + j <= kSteps; ++j) {
            double squared = 0;
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const double a = mesh.points[t[0]][axis], b = mesh.points[t[1]][axis],
                             c = mesh.points[t[2]][axis];
                const double q = a + (b - a) * i / kSteps + (c - a) * j / kSteps;
                squared += (q - p[axis]) * (q - p[axis]);
            }
            nearest = std::min(nearest, std::sqrt(squared));
        }
    }
    return nearest;
}

// Some of the triangles of a sheet are moved or left out, and come back.
TEST(MeshDistance, IsTheSameIfOnlyWhatMayHaveChangedIsMeasuredAgain) {
    constexpr double kMost = 0.2, kReach = 2;
    test::Random random(31);
    const auto unit = [&] { return std::uniform_real_distribution<double>(-1, 1)(random); };
    const auto height = [](double x, double y) { return std::sin(x) * std::cos(0.7 * y); };
    const Mesh original = sheet(10, 40, height),
               sheet_beside =
                   sheet(10, 33, [&](double x, double y) { return height(x, y) + 0.1 * std::sin(3 * x); });
    const auto is_near = [&](const Mesh& mesh, const Triangle& t, const Vec3d& place, double distance) {
        return std::any_of(t.begin(), t.end(), [&](std::uint32_t p) {
            return length(to_double(mesh.points[p]) - place) < distance;
        });
    };
    const internal::SampledMesh from(original, 3000);
    internal::Distances there, back;
    Vec3d last_place{};
    for (int step = 0; step < 12; ++step) {
        const Vec3d place{9 * unit(), 9 * unit(), 0};
        const bool is_left_out = step % 2 == 1;
        const std::vector<Vec3d> places = {last_place, place};
        last_place = place;
        Mesh beside = sheet_beside;
        std::vector<bool> near_changed, changed;
        for (const Triangle& t : original.triangles)
            near_changed.push_back(step == 0 ||
                                   std::any_of(places.begin(), places.end(), [&](const Vec3d& p) {
                                       return is_near(original, t, p, kReach + 3);
                                   }));
        std::vector<std::uint32_t> names;
        beside.triangles.clear();
        for (std::uint32_t t = 0; t < sheet_beside.triangles.size(); ++t) {
            const Triangle& triangle = sheet_beside.triangles[t];
            changed.push_back(step == 0 || std::any_of(places.begin(), places.end(), [&](const Vec3d& p) {
                                  return is_near(sheet_beside, triangle, p, kReach + 1.5);
                              }));
            if (is_left_out && is_near(sheet_beside, triangle, place, kReach)) continue;
            names.push_back(t);
            beside.triangles.push_back(triangle);
        }
        for (Vec3f& p : beside.points)
            if (!is_left_out && length(to_double(p) - place) < kReach) p[2] += 0.3f;
        const internal::SampledMesh now(beside, 3000);
        const auto further_there =
            there.measure_again(from, {.names = {}, .stale = near_changed}, now.tree(), kMost, {}, 0, 1);
        const auto further_back =
            back.measure_again(now, {.names = names, .stale = changed}, from.tree(), kMost, {}, 0, 1);
        const std::vector<bool> all(original.triangles.size(), true);
        internal::Distances all_there, all_back;
        EXPECT_EQ(further_there,
                  all_there.measure_again(from, {.names = {}, .stale = all}, now.tree(), kMost, {}, 0, 1));
        EXPECT_EQ(further_back,
                  all_back.measure_again(now, {.names = names, .stale = all}, from.tree(), kMost, {}, 0, 1));
        EXPECT_FALSE(further_there.empty() && further_back.empty());
        const MeshDistance expected = mesh_distance(original, beside, {.samples = 3000}),
                           found = symmetric(there, back);
        EXPECT_EQ(found.mean, expected.mean);
        EXPECT_EQ(found.max, expected.max);
        EXPECT_EQ(there.max(), all_there.max());
        EXPECT_EQ(back.max(), all_back.max());
    }
}

TEST(Bounds, LeaveOutRangesOfNan) {
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    std::vector<Vec3f> points(20'000, Vec3f{kNan, kNan, kNan});
    points.front() = {1, -2, 3};
    points.back() = {-4, 5, 6};
    const internal::Bounds bounds = internal::bounds_of(points);
    EXPECT_EQ(bounds.lower, (Vec3f{-4, -2, 3}));
    EXPECT_EQ(bounds.upper, (Vec3f{1, 5, 6}));
}

TEST(TriangleTree, FindsTheNearestTriangle) {
    test::Random random(19);
    std::uniform_real_distribution<float> unit(-1, 1);
    const auto anywhere = [&](float size) {
        return Vec3f{size * unit(random), size * unit(random), size * unit(random)};
    };
    for (const std::size_t n : {1u, 2u, 5u, 100u}) {
        Mesh soup;
        for (std::size_t t = 0; t < n; ++t) {
            const Vec3f middle = anywhere(10);
            const auto first = static_cast<std::uint32_t>(soup.points.size());
            for (int c = 0; c < 3; ++c) {
                const Vec3f off = anywhere(t % 7 == 3 ? 0.0f : 1.0f);  // some without area
                soup.points.push_back({middle[0] + off[0], middle[1] + off[1], middle[2] + off[2]});
            }
            soup.triangles.push_back({first, first + 1, first + 2});
        }
        const internal::TriangleTree tree(soup);
        for (int trial = 0; trial < 20; ++trial) {
            const Vec3f p = anywhere(12);
            double nearest = std::numeric_limits<double>::infinity();
            for (const Triangle& t : soup.triangles)
                nearest = std::min(nearest, distance_by_grid(p, soup, t));
            const double found = tree.distance({p[0], p[1], p[2]});
            EXPECT_LE(found, nearest + 1e-6);
            EXPECT_GE(found, nearest - 0.04);  // the step of the grid
        }
    }
}

TEST(TriangleTree, AgreesWithAllTriangles) {
    test::Random random(23);
    const auto unit = [&] { return std::uniform_real_distribution<float>(-1, 1)(random); };
    for (const std::size_t n : {1u, 7u, 8u, 9u, 64u, 65u, 3000u}) {
        Mesh soup;
        const bool crowded = n == 65;  // all triangles have the same Morton key
        for (std::uint32_t t = 0; t < n; ++t) {
            const Vec3f middle{crowded ? 5 : 9 * unit(), crowded ? 5 : 9 * unit(), 0.1f * unit()};
            for (int c = 0; c < 3; ++c)
                soup.points.push_back({middle[0] + unit(), middle[1] + unit(), middle[2] + unit()});
            if (t % 5 == 3) soup.points.back() = soup.points[soup.points.size() - 2];  // without area
            soup.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
        }
        const internal::TriangleTree tree(soup);
        for (int trial = 0; trial < 300; ++trial) {
            const Vec3d p{10.0 * unit(), 10.0 * unit(), 3.0 * unit()};
            double squared = std::numeric_limits<double>::infinity();
            for (const Triangle& t : soup.triangles) {
                const auto [a, b, c] = internal::corners_of(soup, t);
                squared = std::min(squared, internal::squared_distance_to_triangle(p, a, b, c));
            }
            const double nearest = std::sqrt(squared);
            ASSERT_EQ(tree.distance(p), nearest);
            EXPECT_TRUE(tree.is_within(p, 1.001 * nearest));
            EXPECT_FALSE(tree.is_within(p, 0.999 * nearest));
            // Any triangle within `enough` may be found. If there is none, the nearest is found.
            EXPECT_LE(tree.distance(p, 1.5 * nearest), 1.5 * nearest);
            EXPECT_EQ(tree.distance(p, 0.9 * nearest), nearest);
        }
    }
}

TEST(TriangleTree, FindsTheSameForGroupsOfAnySizeAndReach) {
    test::Random random(29);
    const auto unit = [&] { return std::uniform_real_distribution<float>(-1, 1)(random); };
    for (const std::size_t n : {1u, 9u, 3000u}) {
        Mesh soup;
        for (std::uint32_t t = 0; t < n; ++t) {
            const Vec3f middle{9 * unit(), 9 * unit(), 0.1f * unit()};
            for (int c = 0; c < 3; ++c)
                soup.points.push_back({middle[0] + unit(), middle[1] + unit(), middle[2] + unit()});
            soup.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
        }
        const internal::TriangleTree tree(soup);
        for (const std::size_t size : {std::size_t{1}, std::size_t{5}, internal::kMostInGroup}) {
            // A spread of 20 lists too many leaves of the largest soup.
            for (const double spread : {0.0, 0.5, 20.0}) {
                for (const double reach : {0.0, 0.3, 3.0, 1e9}) {
                    const Vec3d middle{10.0 * unit(), 10.0 * unit(), 3.0 * unit()};
                    std::vector<internal::NearestQuery> queries(size);
                    for (internal::NearestQuery& query : queries)
                        query.position = middle + spread * Vec3d{unit(), unit(), unit()};
                    tree.find_nearest(queries, reach);
                    for (internal::NearestQuery& query : queries) {
                        const double nearest = tree.distance(query.position);
                        ASSERT_EQ(std::sqrt(query.squared_distance), nearest);
                        query.enough = 1.5 * nearest;
                    }
                    tree.find_nearest(queries, reach);
                    for (const internal::NearestQuery& query : queries)
                        EXPECT_LE(std::sqrt(query.squared_distance), query.enough);
                }
            }
        }
    }
}

TEST(TriangleTree, FindsTrianglesAtDistanceZero) {
    const Mesh mesh = sphere(4, 3);
    const internal::TriangleTree tree(mesh);
    for (const Vec3f& p : mesh.points) {
        const Vec3d at = to_double(p);
        EXPECT_EQ(tree.distance(at), 0);
        for (const double within : {0.0, 1e-200, 1e-30}) EXPECT_TRUE(tree.is_within(at, within));
    }
}

TEST(TriangleTree, FindsTrianglesWhoseSquaredDistanceOverflowsFloat) {
    Mesh far = sphere(1, 1);
    const internal::TriangleTree tree(far);
    EXPECT_NEAR(tree.distance({3e30, 0, 0}) / 3e30, 1, 1e-12);
}

TEST(MeshDistance, IgnoresPointsWithoutTriangles) {
    const Mesh ball = sphere(1, 3);
    Mesh beside = ball;
    beside.points.push_back({100, 0, 0});
    EXPECT_LT(mesh_distance(ball, beside).max, 1e-6);
    EXPECT_LT(mesh_distance(beside, ball).max, 1e-6);
}

TEST(MeshDistance, RejectsEmptyMeshesAndCanBeCancelled) {
    const Mesh ball = sphere(1, 1);
    Mesh nowhere = ball;
    nowhere.points[0][1] = std::nanf("");
    EXPECT_THROW(mesh_distance(ball, nowhere), InputError);
    EXPECT_THROW(mesh_distance(nowhere, ball), InputError);
    EXPECT_THROW(triangle_quality(nowhere), InputError);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // these end the program instead
    EXPECT_THROW(mesh_distance(ball, ball, {.samples = std::int64_t{1} << 50}), LimitError);
#endif
    EXPECT_THROW(mesh_distance(ball, {}), InputError);
    EXPECT_THROW(mesh_distance({}, ball), InputError);
    EXPECT_THROW(mesh_distance(ball, ball, {.samples = 0}), InputError);
    const Progress stop = [](double) { return false; };
    EXPECT_THROW(mesh_distance(ball, ball, {.progress = stop}), Cancelled);
    EXPECT_THROW(mean_curvature(ball, {.progress = stop}), Cancelled);
    EXPECT_THROW(roughness(ball, 1, {.progress = stop}), Cancelled);
}

}  // namespace
}  // namespace marrow
