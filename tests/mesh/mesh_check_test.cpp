// Tests check_mesh with meshes that have known faults.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>

#include <marrow/components.h>
#include <marrow/error.h>
#include <marrow/isosurface.h>
#include <marrow/measure.h>
#include <marrow/mesh_check.h>

#include "support/fields.h"

namespace marrow::test {
namespace {

Mesh tetrahedron(const Vec3f& at = {0, 0, 0}) {
    Mesh mesh;
    for (const Vec3f& p : {Vec3f{0, 0, 0}, Vec3f{1, 0, 0}, Vec3f{0, 1, 0}, Vec3f{0, 0, 1}})
        mesh.points.push_back({at[0] + p[0], at[1] + p[1], at[2] + p[2]});
    mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
    return mesh;
}

Mesh joined(const Mesh& a, const Mesh& b) {
    Mesh both = a;
    const auto shift = static_cast<std::uint32_t>(a.points.size());
    both.points.insert(both.points.end(), b.points.begin(), b.points.end());
    both.normals.clear();
    for (const Triangle& t : b.triangles)
        both.triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
    return both;
}

Mesh extracted(const Geometry& g, const std::function<double(const Vec3d&)>& field) {
    const Volume volume = sampled_in_space<float>(g, field);
    return extract_isosurface(volume, 0);
}

TEST(Check, FindsNoFaultInATetrahedron) {
    const MeshCheck check = check_mesh(tetrahedron());
    EXPECT_TRUE(check.is_sound());
    EXPECT_EQ(check.genus, 0);
    EXPECT_NEAR(check.measures.volume, 1.0 / 6, 1e-9);
}

TEST(Check, CountsHandlesAndCavities) {
    const auto ring = torus({20, 20, 10}, 11, 5.2);
    const MeshCheck one = check_mesh(extracted(grid(41, 41, 21), ring));
    EXPECT_TRUE(one.is_sound());
    EXPECT_EQ(one.genus, 1);
    EXPECT_EQ(one.measures.euler_characteristic, 0);

    const auto ball = sphere({20, 20, 10}, 9.1), hollow = sphere({20, 20, 10}, 4.3);
    const MeshCheck shell = check_mesh(
        extracted(grid(41, 41, 21), [&](const Vec3d& p) { return std::min(ball(p), -hollow(p)); }));
    EXPECT_TRUE(shell.is_sound());
    EXPECT_EQ(shell.cavities, 1);
    EXPECT_EQ(shell.measures.components, 2);
    EXPECT_EQ(shell.genus, 0);
}

TEST(Check, FindsOpenEdges) {
    Mesh open = tetrahedron();
    open.triangles.pop_back();
    const MeshCheck check = check_mesh(open);
    EXPECT_FALSE(check.is_closed());
    EXPECT_TRUE(check.is_manifold());
    EXPECT_EQ(check.measures.boundary_edges, 3);
    EXPECT_FALSE(check.genus);
}

TEST(Check, FindsMisorientedTriangles) {
    Mesh mesh = tetrahedron();
    std::swap(mesh.triangles[3][0], mesh.triangles[3][1]);
    const MeshCheck one = check_mesh(mesh);
    EXPECT_EQ(one.misoriented_edges, 3);
    EXPECT_FALSE(one.is_oriented());
    EXPECT_TRUE(one.is_manifold());

    Mesh inward = tetrahedron();
    for (Triangle& t : inward.triangles) std::swap(t[0], t[1]);
    const MeshCheck all = check_mesh(inward);
    EXPECT_EQ(all.misoriented_edges, 0);
    EXPECT_FALSE(all.is_oriented());
    EXPECT_EQ(all.cavities, 1);
}

Mesh turned_inside_out(Mesh mesh) {
    for (Triangle& t : mesh.triangles) std::swap(t[0], t[1]);
    return mesh;
}

TEST(Check, FindsClosedComponentsThatAreInsideOut) {
    const Mesh large = extracted(grid(41, 41, 41), sphere({20, 20, 20}, 15)),
               small = turned_inside_out(extracted(grid(41, 41, 41), sphere({20, 20, 20}, 5)));
    const auto moved = [](Mesh mesh, float x) {
        for (Vec3f& p : mesh.points) p[0] += x;
        return mesh;
    };
    const MeshCheck inside = check_mesh(joined(large, small));
    EXPECT_TRUE(inside.is_sound());
    EXPECT_EQ(inside.cavities, 1);
    // Beside the other component, and within its bounds but outside of it.
    for (const Mesh& mesh : {joined(large, moved(small, 40)), joined(moved(small, -40), large),
                             joined(large, turned_inside_out(tetrahedron({8, 8, 8})))}) {
        const MeshCheck beside = check_mesh(mesh);
        EXPECT_FALSE(beside.is_oriented());
        EXPECT_FALSE(beside.is_sound());
    }
    // An island in a cavity, with a cavity of its own.
    const Mesh island = extracted(grid(41, 41, 41), sphere({20, 20, 20}, 3)),
               bubble = turned_inside_out(extracted(grid(41, 41, 41), sphere({20, 20, 20}, 2)));
    EXPECT_TRUE(check_mesh(joined(joined(large, small), joined(island, bubble))).is_sound());
    EXPECT_FALSE(check_mesh(joined(joined(large, small), turned_inside_out(island))).is_sound());
}

TEST(Check, FindsNonManifoldEdgesAndPoints) {
    // Two tetrahedra that share a point, and two that share an edge.
    Mesh at_point = joined(tetrahedron(), tetrahedron({5, 5, 5}));
    for (Triangle& t : at_point.triangles) std::replace(t.begin(), t.end(), 4u, 0u);
    const MeshCheck point = check_mesh(at_point);
    EXPECT_EQ(point.nonmanifold_points, 1);
    EXPECT_EQ(point.unused_points, 1);
    EXPECT_TRUE(point.is_closed());
    EXPECT_FALSE(point.is_manifold());
    EXPECT_FALSE(point.genus);

    Mesh at_edge = joined(tetrahedron(), tetrahedron({5, 5, 5}));
    for (Triangle& t : at_edge.triangles) {
        std::replace(t.begin(), t.end(), 4u, 0u);
        std::replace(t.begin(), t.end(), 5u, 1u);
    }
    const MeshCheck edge = check_mesh(at_edge);
    EXPECT_EQ(edge.measures.nonmanifold_edges, 1);
    EXPECT_EQ(edge.misoriented_edges, 0);
    EXPECT_FALSE(edge.is_manifold());
}

TEST(Check, CountsDegenerateTrianglesOnce) {
    Mesh mesh = tetrahedron();
    mesh.triangles.push_back({1, 1, 2});
    const MeshCheck twice = check_mesh(mesh);
    EXPECT_EQ(twice.degenerate_triangles, 1);
    EXPECT_TRUE(twice.is_closed());
    EXPECT_FALSE(twice.is_sound());

    Mesh flat = tetrahedron();
    flat.points[3] = {0.5f, 0, 0};
    EXPECT_EQ(check_mesh(flat).degenerate_triangles, 1) << "the side 0, 1, 3";
}

TEST(Check, CountsPairsThatPassThroughEachOther) {
    EXPECT_EQ(check_mesh(joined(tetrahedron(), tetrahedron({2, 0, 0}))).self_intersections, 0);
    EXPECT_EQ(check_mesh(joined(tetrahedron(), tetrahedron({1, 0, 0}))).self_intersections, 0) << "touching";
    // The upper corner of the second tetrahedron is above the bottom of the first. Its three sides cross the
    // bottom.
    const MeshCheck through = check_mesh(joined(tetrahedron(), tetrahedron({0.2f, 0.2f, -0.7f})));
    EXPECT_EQ(through.self_intersections, 3);
    EXPECT_FALSE(through.is_sound());
}

std::uint32_t below(Random& random, std::uint32_t n) {
    return static_cast<std::uint32_t>(random() % n);
}

// An axis-aligned box. Each side consists of `parts`^2 squares of two triangles.
Mesh box(const Vec3f& lower, const Vec3f& upper, int parts = 1, bool other_diagonals = false) {
    Mesh mesh;
    std::map<Vec3f, std::uint32_t> numbers;
    const auto point = [&](std::size_t axis, bool high, int i, int j) {
        std::array<int, 3> at;
        at[axis] = high ? parts : 0;
        at[(axis + 1) % 3] = i;
        at[(axis + 2) % 3] = j;
        Vec3f p;
        for (std::size_t k = 0; k < 3; ++k)
            p[k] = lower[k] + (upper[k] - lower[k]) * static_cast<float>(at[k]) / static_cast<float>(parts);
        const auto [found, added] = numbers.try_emplace(p, static_cast<std::uint32_t>(mesh.points.size()));
        if (added) mesh.points.push_back(p);
        return found->second;
    };
    for (std::size_t axis = 0; axis < 3; ++axis) {
        for (const bool high : {false, true}) {
            for (int i = 0; i < parts; ++i) {
                for (int j = 0; j < parts; ++j) {
                    std::array<std::uint32_t, 4> q{point(axis, high, i, j), point(axis, high, i + 1, j),
                                                   point(axis, high, i + 1, j + 1),
                                                   point(axis, high, i, j + 1)};
                    if (!high) std::swap(q[1], q[3]);
                    if (other_diagonals) std::rotate(q.begin(), q.begin() + 1, q.end());
                    mesh.triangles.push_back({q[0], q[1], q[2]});
                    mesh.triangles.push_back({q[0], q[2], q[3]});
                }
            }
        }
    }
    return mesh;
}

TEST(Check, FindsOverlappingBoxesWithCommonCoordinates) {
    // The coordinates are integers, so edges of one box pass through diagonals and points of the other, or
    // are in its sides.
    Random random(11);
    for (int trial = 0; trial < 300; ++trial) {
        const auto length = [&] { return static_cast<float>(2 * below(random, 4) + 4); };
        const auto parts = [&] { return static_cast<int>(below(random, 4) + 1); };
        Vec3f upper_a, lower_b, upper_b;
        for (std::size_t k = 0; k < 3; ++k) {
            upper_a[k] = length();
            lower_b[k] = static_cast<float>(1 + below(random, static_cast<std::uint32_t>(upper_a[k]) - 1));
            upper_b[k] = upper_a[k] + length();
        }
        const Mesh both = joined(box({0, 0, 0}, upper_a, parts(), below(random, 2) == 0),
                                 box(lower_b, upper_b, parts(), below(random, 2) == 0));
        ASSERT_GT(check_mesh(both).self_intersections, 0) << "trial " << trial;
    }
}

TEST(Check, FindsTheIntersectionsOfAStellaOctangula) {
    Mesh one;
    one.points = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
    one.triangles = {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}};
    Mesh other = one;
    for (Vec3f& p : other.points) p = {-p[0], -p[1], -p[2]};
    for (Triangle& t : other.triangles) std::swap(t[0], t[1]);
    // The two tetrahedra have the corners of a cube. They intersect along the twelve edges of an octahedron,
    // one for each pair of triangles that intersect.
    EXPECT_EQ(check_mesh(joined(one, other)).self_intersections, 12);
}

TEST(Check, FindsIntersectionsAlongEdgesOfBoth) {
    // The boxes intersect only along edges of both. These edges have different lengths in the second case.
    const Mesh a = box({0, 0, 0}, {10, 10, 10}, 2);
    EXPECT_GT(check_mesh(joined(a, box({5, 5, 5}, {15, 15, 15}, 2))).self_intersections, 0);
    EXPECT_GT(check_mesh(joined(a, box({5, 5, 5}, {15, 15, 15}, 4))).self_intersections, 0);
}

TEST(Check, IgnoresBoxesThatOnlyTouch) {
    const Mesh a = box({0, 0, 0}, {4, 4, 4});
    const std::pair<const char*, Mesh> cases[] = {
        {"a side on a side", box({4, 0, 0}, {8, 4, 4})},
        {"a side on the middle of a side", box({4, 1, 1}, {6, 3, 3}, 2)},
        {"a side that extends beyond a side", box({4, 2, -2}, {6, 6, 6}, 3, true)},
        {"an edge on an edge", box({4, 4, 0}, {8, 8, 4})},
        {"an edge that extends beyond an edge", box({4, 4, 1}, {8, 8, 7}, 3)},
        {"a corner on a corner", box({4, 4, 4}, {8, 8, 8})},
        {"a corner on an edge", box({4, 4, 1}, {8, 8, 2})},
        {"a box inside, at two sides", box({0, 0, 1}, {2, 3, 2})},
        {"the same box", a},
        {"the same box with other triangles", box({0, 0, 0}, {4, 4, 4}, 3, true)},
    };
    for (const auto& [name, b] : cases) {
        EXPECT_EQ(check_mesh(joined(a, b)).self_intersections, 0) << name;
        EXPECT_EQ(check_mesh(joined(b, a)).self_intersections, 0) << name;
    }
    // A wedge whose edge is on the middle of a side, and the same wedge flattened into the side.
    Mesh wedge;
    wedge.points = {{1, 2, 4}, {3, 2, 4}, {2, 1, 6}, {2, 3, 6}};
    wedge.triangles = {{0, 1, 3}, {1, 0, 2}, {0, 3, 2}, {1, 2, 3}};
    EXPECT_EQ(check_mesh(joined(a, wedge)).self_intersections, 0);
    for (Vec3f& p : wedge.points) p[2] = 4;
    EXPECT_EQ(check_mesh(joined(a, wedge)).self_intersections, 0);
}

TEST(Check, DecidesExactly) {
    // A corner is exactly in a side, or above or below it by one bit of a coordinate.
    const float third = 1.0f / 3, up = std::nextafter(1.0f, 2.0f), down = std::nextafter(1.0f, 0.0f);
    const auto intersections = [&](float z) {
        Mesh mesh;
        mesh.points = {{0, 0, 1}, {3, 0, 1}, {0, 3, 1}, {third, third, z}, {third, 1, 4}, {1, third, 4}};
        mesh.triangles = {{0, 1, 2}, {3, 4, 5}};
        return check_mesh(mesh).self_intersections;
    };
    EXPECT_EQ(intersections(1), 0);
    EXPECT_EQ(intersections(up), 0);
    EXPECT_EQ(intersections(down), 1);
    const auto far_from_zero = [&](float x) {  // rounding hides the intersection
        Mesh mesh;
        mesh.points = {{0, 0, 0},       {1e7f, 1e7f, 1},     {-1e7f, 1e7f, 0},
                       {x, 1e6f, 5e5f}, {1e6f, 1e6f, -5e5f}, {1e6f, 2e6f, 1}};
        mesh.triangles = {{0, 1, 2}, {3, 4, 5}};
        return check_mesh(mesh).self_intersections;
    };
    EXPECT_EQ(far_from_zero(1e6f), 1);
}

// Two triangles alone have no closed fans, and no neighbours that could be near.
bool is_self_intersection(const Mesh& mesh, const Triangle& s, const Triangle& t) {
    Mesh pair;
    std::map<std::uint32_t, std::uint32_t> numbers;
    for (const Triangle& from : {s, t}) {
        Triangle& to = pair.triangles.emplace_back();
        for (std::size_t c = 0; c < 3; ++c) {
            const auto [at, is_new] =
                numbers.try_emplace(from[c], static_cast<std::uint32_t>(pair.points.size()));
            if (is_new) pair.points.push_back(mesh.points[from[c]]);
            to[c] = at->second;
        }
    }
    return check_mesh(pair, {.threads = 1}).self_intersections > 0;
}

bool boxes_overlap(const Mesh& mesh, const Triangle& s, const Triangle& t) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto range = [&](const Triangle& triangle) {
            return std::minmax({mesh.points[triangle[0]][axis], mesh.points[triangle[1]][axis],
                                mesh.points[triangle[2]][axis]});
        };
        const auto [s_least, s_most] = range(s);
        const auto [t_least, t_most] = range(t);
        if (s_most < t_least || t_most < s_least) return false;
    }
    return true;
}

std::int64_t count_by_pairs(const Mesh& mesh) {
    std::int64_t pairs = 0;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        for (std::size_t j = 0; j < i; ++j) {
            const Triangle &s = mesh.triangles[i], &t = mesh.triangles[j];
            pairs += boxes_overlap(mesh, s, t) && is_self_intersection(mesh, s, t);
        }
    }
    return pairs;
}

TEST(Check, FindsWhatPairsOfTrianglesShow) {
    Random random(11);
    for (const double crumple : {0.1, 0.3, 1.0}) {
        Mesh mesh = extracted(grid(11, 11, 11), sphere({5, 5, 5}, 3.3));
        for (Vec3f& p : mesh.points) {
            for (float& x : p) x += static_cast<float>(std::normal_distribution<double>(0, crumple)(random));
        }
        const std::int64_t pairs = count_by_pairs(mesh);
        EXPECT_EQ(check_mesh(mesh).self_intersections, pairs) << "crumpled by " << crumple;
        EXPECT_GT(pairs, 0);
    }
}

// All triangles of a disc face the same way, but they go around its centre twice.
TEST(Check, FindsAFanThatGoesAroundTwice) {
    constexpr std::uint32_t kSides = 10;
    Mesh mesh;
    mesh.points = {{0, 0, 0}};
    for (const double radius : {1.0, 2.0}) {
        for (std::uint32_t i = 0; i < kSides; ++i) {
            const double angle = i * 4 * M_PI / kSides, height = 0.3 * std::sin(angle / 2 + 0.1);
            mesh.points.push_back({static_cast<float>(radius * std::cos(angle)),
                                   static_cast<float>(radius * std::sin(angle)),
                                   static_cast<float>(radius * height)});
        }
    }
    for (std::uint32_t i = 0; i < kSides; ++i) {
        const std::uint32_t a = 1 + i, b = 1 + (i + 1) % kSides;
        mesh.triangles.push_back({0, a, b});
        mesh.triangles.push_back({a, a + kSides, b + kSides});
        mesh.triangles.push_back({a, b + kSides, b});
    }
    const std::int64_t pairs = count_by_pairs(mesh);
    EXPECT_GT(pairs, 0);
    EXPECT_EQ(check_mesh(mesh).self_intersections, pairs);
}

// A sheet of 2 * size^2 triangles that shows its front along z, if it is not too steep.
Mesh sheet(std::uint32_t size, const std::function<Vec3d(double x, double y)>& position) {
    Mesh mesh;
    for (std::uint32_t y = 0; y <= size; ++y) {
        for (std::uint32_t x = 0; x <= size; ++x) mesh.points.push_back(to_float(position(x, y)));
    }
    for (std::uint32_t y = 0; y < size; ++y) {
        for (std::uint32_t x = 0; x < size; ++x) {
            const std::uint32_t p = y * (size + 1) + x, above = p + size + 1;
            mesh.triangles.push_back({p, p + 1, above + 1});
            mesh.triangles.push_back({p, above + 1, above});
        }
    }
    return mesh;
}

// Turns axes into each other, and moves everything away from the origin.
Mesh turned(Mesh mesh, std::size_t by, float away) {
    for (Vec3f& p : mesh.points) {
        const Vec3f from = p;
        for (std::size_t axis = 0; axis < 3; ++axis) p[(axis + by) % 3] = from[axis] + away;
    }
    return mesh;
}

// All triangles of these face the same way, and most are far from intersections.
TEST(Check, FindsWhereSheetsPassThroughEachOther) {
    Random random(3);
    const auto noise = [&](double most) { return std::uniform_real_distribution<>(-most, most)(random); };
    const auto flat = [](double x, double y) { return Vec3d{x, y, 0}; };
    const auto wavy = [](double x, double y) {
        return Vec3d{x, y, 3 * std::sin(0.3 * x) * std::sin(0.2 * y)};
    };
    const auto above = [](const auto& position, double by) {
        return [=](double x, double y) { return position(x, y) + Vec3d{0, 0, by}; };
    };
    const auto dented = [&](double x, double y) {  // a single point reaches down through the sheet below
        return wavy(x, y) + Vec3d{0, 0, x == 13 && y == 17 ? -0.01 : 4};
    };
    const auto coarse = [](double x, double y) { return Vec3d{10 * x, 10 * y, 0.1}; };
    const auto rough = [&](double x, double y) {
        return wavy(x, y) + Vec3d{noise(0.6), noise(0.6), noise(0.3)};
    };
    const auto folded = [&](double x, double y) {
        return wavy(x, y) + Vec3d{noise(0.9), noise(0.9), noise(0.3)};
    };
    // Two turns of a ramp, which come through each other.
    const auto ramp = [](double x, double y) {
        const double angle = x * 4 * M_PI / 20, radius = 4 + y / 2;
        return Vec3d{radius * std::cos(angle), radius * std::sin(angle), angle / 2 + 2 * std::sin(angle / 2)};
    };
    const auto steep_ramp = [&](double x, double y) { return ramp(x, y) + Vec3d{0, 0, x / 2}; };
    struct Case {
        const char* name;
        Mesh mesh;
        bool intersects;
    };
    const std::uint32_t size = 20;
    const Case cases[] = {
        {"flat sheets above each other", joined(sheet(size, flat), sheet(size, above(flat, 1))), false},
        {"wavy sheets above each other", joined(sheet(size, wavy), sheet(size, above(wavy, 0.3))), false},
        {"a wavy sheet through a flat one", joined(sheet(size, flat), sheet(size, wavy)), true},
        {"a dent", joined(sheet(size, wavy), sheet(size, dented)), true},
        {"a coarse sheet through a fine one", joined(sheet(size, wavy), sheet(2, coarse)), true},
        {"a rough sheet", sheet(size, rough), true},
        {"a folded sheet", sheet(size, folded), true},
        {"a ramp", sheet(size, steep_ramp), false},
        {"a ramp through itself", sheet(size, ramp), true},
    };
    for (const auto& [name, mesh, intersects] : cases) {
        for (const float away : {0.0f, 1e5f}) {
            const std::int64_t pairs = count_by_pairs(turned(mesh, 0, away));
            EXPECT_EQ(pairs > 0, intersects) << name << ", " << away;
            for (std::size_t by = 0; by < 3; ++by) {
                Mesh other = turned(mesh, by, away);
                EXPECT_EQ(check_mesh(other).self_intersections, pairs) << name << ", " << by << ", " << away;
                for (Triangle& t : other.triangles) std::swap(t[0], t[1]);
                EXPECT_EQ(check_mesh(other).self_intersections, pairs) << name << ", turned over";
            }
        }
    }
}

TEST(Check, FindsSelfIntersectionsBesideDistantPoints) {
    Mesh mesh = joined(sheet(20,
                             [](double x, double y) {
                                 return Vec3d{x, y, 0};
                             }),
                       sheet(20, [](double x, double y) {
                           return Vec3d{x, y, x - 10.3};
                       }));
    const std::int64_t pairs = count_by_pairs(mesh);
    EXPECT_GT(pairs, 0);
    // A point without triangles makes the bounds huge, and others a thousand times as large as the rest.
    mesh.points.push_back({1e30f, -1e30f, 1e30f});
    EXPECT_EQ(check_mesh(mesh).self_intersections, pairs);
    mesh.points.back() = {1e5f, 0, 1e4f};
    mesh.points.push_back({1e5f, 1, 1e4f});
    mesh.triangles.push_back({0, 882, 883});
    EXPECT_EQ(check_mesh(mesh).self_intersections, count_by_pairs(mesh));
}

TEST(Check, FindsNoSelfIntersectionsInExtractedSurfaces) {
    Random random(5);
    for (int trial = 0; trial < 100; ++trial) {
        const RandomGrid one = random_grid(random);
        const Mesh mesh = extract_isosurface(one.volume, one.isovalue, {.closed = true});
        if (mesh.triangles.empty()) continue;
        const MeshCheck check = check_mesh(mesh);
        ASSERT_EQ(check.self_intersections, 0) << "trial " << trial;
        ASSERT_TRUE(check.is_closed() && check.is_manifold() && check.misoriented_edges == 0);
    }
}

TEST(Check, MeasuresThinWalls) {
    // A hollow ball with a wall of 2 mm.
    const auto outer = sphere({15, 15, 15}, 12), inner = sphere({15, 15, 15}, 10);
    const Mesh mesh =
        extracted(grid(31, 31, 31), [&](const Vec3d& p) { return std::min(outer(p), -inner(p)); });
    const MeshCheck thick = check_mesh(mesh, {.min_wall = 1.8});
    EXPECT_EQ(thick.thin_triangles, 0);
    EXPECT_FALSE(thick.thinnest_wall);
    const MeshCheck thin = check_mesh(mesh, {.min_wall = 2.2});
    EXPECT_NEAR(thin.thin_area / (4 * M_PI * (144 + 100)), 1, 0.02);
    EXPECT_NEAR(thin.thinnest_wall.value(), 2, 0.15);
    EXPECT_TRUE(thin.is_sound()) << "thin walls are a matter of the printer";
    EXPECT_EQ(check_mesh(mesh).thin_triangles, 0) << "there was no min_wall";
}

TEST(Check, MeasuresNoWallWhereBodiesTouch) {
    const MeshCheck check =
        check_mesh(joined(box({0, 0, 0}, {4, 4, 4}), box({4, 1, 1}, {8, 3, 3})), {.min_wall = 1});
    EXPECT_EQ(check.thin_triangles, 0);
    EXPECT_FALSE(check.thinnest_wall);
}

TEST(Check, FindsCrossingsBetweenMeshes) {
    const Mesh first = tetrahedron(), beside = tetrahedron({3, 0, 0}),
               through = tetrahedron({0.25, 0.25, 0.125});
    Mesh against = tetrahedron();  // behind the face x = 0 of the first, with the same corners
    against.points[1] = {-1, 0, 0};
    for (Triangle& t : against.triangles) std::swap(t[1], t[2]);
    Mesh inside = tetrahedron();
    for (Vec3f& p : inside.points) p = {p[0] / 8 + 0.125f, p[1] / 8 + 0.125f, p[2] / 8 + 0.125f};
    const MeshView meshes[] = {first, beside, against, inside, through};
    const std::vector<MeshCrossing> crossings = find_crossings(meshes);
    ASSERT_EQ(crossings.size(), 1u);
    EXPECT_EQ(crossings[0].first, 0u);
    EXPECT_EQ(crossings[0].second, 4u);
    EXPECT_GT(crossings[0].pairs, 0);
    EXPECT_TRUE(find_crossings({}).empty());
    EXPECT_THROW(find_crossings(meshes, {.progress = [](double) { return false; }}), Cancelled);
}

TEST(Check, RejectsInvalidInputAndCanBeCancelled) {
    Mesh mesh = tetrahedron();
    mesh.points[1][0] = std::numeric_limits<float>::infinity();
    EXPECT_THROW(check_mesh(mesh), InputError);
    EXPECT_THROW(check_mesh(tetrahedron(), {.min_wall = -1}), InputError);
    EXPECT_THROW(check_mesh(tetrahedron(), {.progress = [](double) { return false; }}), Cancelled);
    mesh = tetrahedron();
    mesh.triangles[0][0] = 4;
    EXPECT_THROW(check_mesh(mesh), InputError);
    EXPECT_FALSE(check_mesh({}).is_sound());
}

// The arrays of a view need not be those of a Mesh.
TEST(Check, MeasuresAndWritesViewsOfOtherArrays) {
    const Volume volume = sampled_in_space<float>(grid(20, 20, 20), sphere({9.3, 9.6, 9.1}, 6));
    const Mesh mesh = extract_isosurface(volume, 0);
    const std::vector<Vec3f> points(mesh.points.begin(), mesh.points.end());
    const std::vector<Triangle> triangles(mesh.triangles.begin(), mesh.triangles.end());
    const MeshView view(points, triangles);
    EXPECT_EQ(measure(view).volume, measure(mesh).volume);
    EXPECT_EQ(check_mesh(view).self_intersections, 0);
    EXPECT_LT(mesh_distance(view, mesh).max, 1e-12);
    Mesh kept = keep_components(view, {});
    EXPECT_EQ(kept.points, mesh.points);
    EXPECT_TRUE(kept.normals.empty());
}

}  // namespace
}  // namespace marrow::test
