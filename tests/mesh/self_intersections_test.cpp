// Tests searches for self-intersections among some triangles, against the search of everything.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <random>
#include <vector>

#include <marrow/isosurface.h>
#include <marrow/mesh.h>

#include "mesh/connectivity/one_rings.h"
#include "mesh/intersections/block_pairs.h"
#include "mesh/intersections/self_intersections.h"
#include "mesh/intersections/triangle_blocks.h"
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

std::vector<TrianglePair> all_pairs(const Mesh& mesh) {
    return find_self_intersections(mesh, OneRings(mesh));
}

// Those that share a point with one of a pair include those that share an edge.
TEST(SelfIntersectionsTest, FindsPairsAmongTheTrianglesAroundThem) {
    std::mt19937 random(24);
    const Mesh bowl = thick_bowl();
    std::size_t found = 0;
    for (int round = 0; round < 60; ++round) {
        Mesh mesh = bowl;
        shake(mesh, random, 1 + round % 4);
        const std::vector<TrianglePair> expected = all_pairs(mesh);
        std::vector<std::uint8_t> is_near(mesh.points.size());
        for (const TrianglePair& pair : expected) {
            EXPECT_TRUE(may_pass_through(mesh, pair));
            for (const std::uint32_t t : pair)
                for (const std::uint32_t p : mesh.triangles[t]) is_near[p] = 1;
        }
        Buffer<std::uint32_t> near;
        for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
            const auto& [a, b, c] = mesh.triangles[t];
            if (is_near[a] != 0 || is_near[b] != 0 || is_near[c] != 0) near.push_back(t);
        }
        EXPECT_EQ(find_self_intersections_among(mesh, near), expected) << round;
        found += expected.size();
    }
    EXPECT_GT(found, 100u);
}

// The triangles whose boxes overlap that of one.
std::vector<std::uint32_t> overlapping(const Mesh& mesh, std::uint32_t t) {
    std::vector<std::uint32_t> found;
    for (std::uint32_t other = 0; other < mesh.triangles.size(); ++other) {
        if (bounds_of(mesh, mesh.triangles[t]).overlaps(bounds_of(mesh, mesh.triangles[other])))
            found.push_back(other);
    }
    return found;
}

// Points move far and back again, so that the boxes of the tree grow, shrink and stay.
TEST(SelfIntersectionsTest, FindsPairsOfChangedTriangles) {
    std::mt19937 random(31);
    const Mesh bowl = thick_bowl();
    Mesh mesh = bowl;
    SelfIntersections search(mesh);
    TrianglePyramid pyramid(mesh);
    std::size_t found = 0, without = 0;
    for (int round = 0; round < 300; ++round) {
        const std::uint32_t p = mesh.triangles[random() % mesh.triangles.size()][0];
        const float scale = round % 2 == 0 ? 1 : 30;
        for (std::size_t axis = 0; axis < 3; ++axis)
            mesh.points[p][axis] =
                bowl.points[p][axis] + scale * (static_cast<float>(random() % 1001) / 500 - 1);
        std::vector<std::uint32_t> changed;
        for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
            const Triangle& corners = mesh.triangles[t];
            if (std::find(corners.begin(), corners.end(), p) != corners.end()) changed.push_back(t);
        }
        std::vector<TrianglePair> expected = all_pairs(mesh);
        std::erase_if(expected, [&](const TrianglePair& pair) {
            return std::none_of(changed.begin(), changed.end(),
                                [&](std::uint32_t t) { return t == pair[0] || t == pair[1]; });
        });
        std::shuffle(changed.begin(), changed.end(), random);
        EXPECT_EQ(search.any_changed_pair(changed), !expected.empty()) << round;
        EXPECT_EQ(search.find_changed(changed), expected) << round;
        for (const std::uint32_t t : changed) {
            const bool is_in_one =
                std::any_of(expected.begin(), expected.end(),
                            [&](const TrianglePair& pair) { return t == pair[0] || t == pair[1]; });
            EXPECT_EQ(search.any_changed_pair({t}), is_in_one) << round;
            pyramid.set_box(t, bounds_of(mesh, mesh.triangles[t]));
        }
        for (const std::uint32_t t : {changed.front(), changed.back()}) {
            std::vector<std::uint32_t> near = pyramid.overlapping(bounds_of(mesh, mesh.triangles[t]));
            std::sort(near.begin(), near.end());
            EXPECT_EQ(near, overlapping(mesh, t)) << round;
        }
        mesh.points[p] = bowl.points[p];
        search.update(changed);
        for (const std::uint32_t t : changed) pyramid.set_box(t, bounds_of(mesh, mesh.triangles[t]));
        ++(expected.empty() ? without : found);
    }
    EXPECT_GT(found, 50u);
    EXPECT_GT(without, 50u);
}

TEST(SelfIntersectionsTest, FindsInBlocksWhatAPyramidFinds) {
    std::mt19937 random(17);
    std::size_t found = 0;
    for (int round = 0; round < 40; ++round) {
        Mesh mesh = thick_bowl();
        shake(mesh, random, 5 * round);
        const OneRings rings(mesh);
        ASSERT_TRUE(find_triangle_blocks(mesh, rings));
        const std::vector<TrianglePair> pairs = find_self_intersections(mesh, rings);
        EXPECT_EQ(pairs, find_self_intersections(mesh, rings, std::nullopt)) << round;
        found += pairs.size();
    }
    EXPECT_GT(found, 1000u);
}

TEST(SelfIntersectionsTest, FindsWhatAPyramidFindsInACrowdedBlock) {
    std::mt19937 random(18);
    std::normal_distribution<float> by(0, 0.1f);
    Mesh mesh = thick_bowl();
    const Vec3f middle = mesh.points[mesh.points.size() / 3];
    for (std::size_t p = 0; p < mesh.points.size(); ++p) {
        if (length(to_double(mesh.points[p]) - to_double(middle)) >= 6) continue;
        for (std::size_t axis = 0; axis < 3; ++axis)
            mesh.points[p][axis] = middle[axis] + 0.02f * (mesh.points[p][axis] - middle[axis]) + by(random);
    }
    const OneRings rings(mesh);
    const std::optional<TriangleBlocks> blocks = find_triangle_blocks(mesh, rings);
    ASSERT_TRUE(blocks);
    std::map<std::uint32_t, std::size_t> in_block;
    for (const Triangle& t : mesh.triangles) {
        BlockReach(mesh, blocks->grid, t).for_each_block([&](const auto& block) {
            ++in_block[blocks->grid.index(block)];
        });
    }
    const auto fuller = [](const auto& a, const auto& b) { return a.second < b.second; };
    EXPECT_GT(std::max_element(in_block.begin(), in_block.end(), fuller)->second, BlockPairs::kMostInBlock);
    const std::vector<TrianglePair> pairs = find_self_intersections(mesh, rings, blocks);
    EXPECT_EQ(pairs, find_self_intersections(mesh, rings, std::nullopt));
    EXPECT_GT(pairs.size(), 1000u);
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
