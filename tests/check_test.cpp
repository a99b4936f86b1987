#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include <marrow/check.h>
#include <marrow/error.h>
#include <marrow/isosurface.h>

#include "fields.h"

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
    for (const Triangle& t : b.triangles)
        both.triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
    return both;
}

Mesh extracted(const Geometry& g, const std::function<double(const Vec3d&)>& field) {
    const Volume volume = sampled_in_space<float>(g, field);
    return extract_isosurface(volume, 0);
}

TEST(Check, FindsASolidSound) {
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

TEST(Check, FindsTrianglesTheWrongWayRound) {
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

TEST(Check, FindsEdgesAndPointsWhereSheetsMeet) {
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
    mesh.triangles.push_back({1, 1, 2});  // a point twice
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
    // The other's corner (0.2, 0.2, -0.5) + (0, 0, 1) sticks through the bottom: its three sides there cross it.
    const MeshCheck through = check_mesh(joined(tetrahedron(), tetrahedron({0.2f, 0.2f, -0.7f})));
    EXPECT_EQ(through.self_intersections, 3);
    EXPECT_FALSE(through.is_sound());
}

TEST(Check, FindsNoCrossingsInWhatIsExtracted) {
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
    // A hollow ball whose wall is 2 mm thick.
    const auto outer = sphere({15, 15, 15}, 12), inner = sphere({15, 15, 15}, 10);
    const Mesh mesh =
        extracted(grid(31, 31, 31), [&](const Vec3d& p) { return std::min(outer(p), -inner(p)); });
    EXPECT_EQ(check_mesh(mesh, {.min_wall = 1.8}).thin_triangles, 0);
    const MeshCheck thin = check_mesh(mesh, {.min_wall = 2.2});
    EXPECT_NEAR(thin.thin_area / (4 * M_PI * (144 + 100)), 1, 0.02);
    EXPECT_NEAR(thin.thinnest_wall, 2, 0.15);
    EXPECT_FALSE(thin.is_sound());
    EXPECT_EQ(check_mesh(mesh).thin_triangles, 0) << "not asked for";
}

TEST(Check, RefusesWhatIsNoMesh) {
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

}  // namespace
}  // namespace marrow::test
