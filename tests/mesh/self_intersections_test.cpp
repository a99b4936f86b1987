// Tests the search for self-intersections after changes, against the search of everything.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>
#include <vector>

#include <marrow/isosurface.h>
#include <marrow/mesh.h>

#include "mesh/connectivity/one_rings.h"
#include "mesh/intersections/changed_triangles.h"
#include "mesh/intersections/self_intersections.h"
#include "support/fields.h"

namespace marrow::test {
namespace {

using namespace internal;

// A sphere around a smaller one, both open at the top.
Mesh thick_bowl() {
    const Volume volume = sampled_in_space<float>(grid(24, 24, 20), [](const Vec3d& p) {
        const double from_centre = length(p - Vec3d{11.5, 11.5, 14});
        return std::min(10.3 - from_centre, from_centre - 8.1);
    });
    return extract_isosurface(volume, 0, {.normals = false});
}

// Moves some points far enough to pass through other parts of the surface.
void shake(Mesh& mesh, std::mt19937& random, int count) {
    std::uniform_int_distribution<std::size_t> any(0, mesh.points.size() - 1);
    std::uniform_real_distribution<float> by(-2.5f, 2.5f);
    for (; count > 0; --count) {
        Vec3f& p = mesh.points[any(random)];
        for (std::size_t axis = 0; axis < 3; ++axis) p[axis] += by(random);
    }
}

// Removes a point and its triangles.
void remove_point(Mesh& mesh, std::uint32_t point) {
    std::erase_if(mesh.triangles,
                  [&](const Triangle& t) { return std::count(t.begin(), t.end(), point) > 0; });
    mesh.points.erase(mesh.points.begin() + point);
    for (Triangle& t : mesh.triangles) {
        for (std::uint32_t& p : t) p -= p > point ? 1 : 0;
    }
}

std::vector<TrianglePair> all_pairs(const Mesh& mesh) {
    return find_self_intersections(mesh, OneRings(mesh));
}

TEST(SelfIntersectionsTest, FindsAfterChangesWhatASearchOfEverythingFinds) {
    std::mt19937 random(24);
    const Mesh bowl = thick_bowl();
    std::size_t found = 0, undone = 0;
    for (int round = 0; round < 60; ++round) {
        Mesh before = bowl;
        shake(before, random, round % 4);
        const std::vector<TrianglePair> pairs_before = all_pairs(before);
        // Other points move, some move back, and some are no longer there.
        Mesh after = round % 3 == 0 ? bowl : before;
        shake(after, random, round % 5);
        for (int removed = 0; removed < round % 6; ++removed)
            remove_point(after, std::uniform_int_distribution<std::uint32_t>(
                                    0, static_cast<std::uint32_t>(after.points.size() - 1))(random));
        const std::vector<TrianglePair> expected = all_pairs(after);
        EXPECT_EQ(find_self_intersections_again(after, before, pairs_before), expected) << round;
        found += expected.size();
        undone += expected.empty() && !pairs_before.empty() ? 1 : 0;
    }
    EXPECT_GT(found, 100u);
    EXPECT_GT(undone, 0u);
}

TEST(SelfIntersectionsTest, LooksOnlyAroundChanges) {
    const Mesh bowl = thick_bowl();
    EXPECT_TRUE(triangles_around_changes(bowl, bowl, {}).empty());
    Mesh moved = bowl;
    moved.points[moved.points.size() / 2][0] += 0.1f;
    const std::size_t near = triangles_around_changes(moved, bowl, {}).size();
    EXPECT_GT(near, 5u);
    EXPECT_LT(near, bowl.triangles.size() / 20);
}

// A wall that is two to three edges thick, bent and tilted. Its two sides are in columns of their own.
TEST(SelfIntersectionsTest, FindsWhereAThinWallPassesThroughItself) {
    std::mt19937 random(5);
    const Volume volume = sampled_in_space<float>(grid(30, 30, 24), [](const Vec3d& p) {
        return 1.2 - std::abs(p[2] - 11 - 3 * std::sin(p[0] / 5) - 0.2 * p[1] + 3);
    });
    const Mesh wall = extract_isosurface(volume, 0, {.normals = false, .closed = true});
    EXPECT_TRUE(all_pairs(wall).empty());
    std::size_t found = 0;
    for (int round = 0; round < 40; ++round) {
        Mesh mesh = wall;
        shake(mesh, random, 3);
        const OneRings rings(mesh);
        const std::vector<TrianglePair> pairs = find_self_intersections(mesh, rings);
        // Without blocks, all triangles are looked at.
        EXPECT_EQ(pairs, find_self_intersections(mesh, rings, std::nullopt));
        found += pairs.size();
    }
    EXPECT_GT(found, 100u);
}

}  // namespace
}  // namespace marrow::test
