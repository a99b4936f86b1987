// Tests which components, cavities and points keep_components keeps, and how measure counts components and
// edges.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <numeric>
#include <random>
#include <utility>
#include <vector>

#include <marrow/components.h>
#include <marrow/error.h>
#include <marrow/isosurface.h>
#include <marrow/measure.h>

#include "support/fields.h"
#include "support/mesh_checks.h"

namespace marrow::test {
namespace {

Mesh balls(double first_radius, double second_radius) {
    const auto first = sphere({10, 10, 10}, first_radius), second = sphere({30, 10, 10}, second_radius);
    const Volume volume = sampled_in_space<float>(
        grid(41, 21, 21), [&](const Vec3d& p) { return std::max(first(p), second(p)); });
    return extract_isosurface(volume, 0);
}

constexpr ComponentOptions kLargestAlone{.count = 1, .cavities = false};

TEST(KeepComponents, KeepsTheLargerOfTwoBallsUnchanged) {
    const Mesh both = balls(5, 7);
    ASSERT_EQ(measure(both).components, 2);
    const Mesh larger = keep_components(both, kLargestAlone);
    EXPECT_EQ(manifold_fault(larger), "");
    const Mesh alone = balls(-10, 7);  // a ball of negative radius has no surface
    EXPECT_TRUE(larger.points == alone.points);
    EXPECT_TRUE(larger.normals == alone.normals);
    EXPECT_TRUE(larger.triangles == alone.triangles);
}

TEST(KeepComponents, KeepsTheFirstOfEquallyLargeComponents) {
    Mesh mesh;
    mesh.points = {{9, 9, 9}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 0, 0}, {6, 0, 0}, {5, 1, 0}};
    mesh.triangles = {{4, 5, 6}, {1, 2, 3}};
    const Mesh first = keep_components(mesh, kLargestAlone);
    EXPECT_TRUE(first.points == (Buffer<Vec3f>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
    EXPECT_TRUE(first.triangles == (Buffer<Triangle>{{0, 1, 2}}));
}

TEST(KeepComponents, ReturnsAnEmptyMeshIfThereAreNoTriangles) {
    EXPECT_TRUE(keep_components({}, kLargestAlone).points.empty());
    Mesh unused;
    unused.points = {{0, 0, 0}};
    EXPECT_TRUE(keep_components(unused, kLargestAlone).points.empty());
}

Volume solid(const Geometry& g, const std::function<bool(std::int64_t, std::int64_t, std::int64_t)>& inside) {
    return sampled<std::uint8_t>(g, [&](auto x, auto y, auto z) { return inside(x, y, z) ? 1 : 0; });
}

// A cube of side^3 samples. It begins at x = from and at y = z = 1.
bool in_box(std::int64_t from, std::int64_t side, std::int64_t x, std::int64_t y, std::int64_t z) {
    return x >= from && x < from + side && y >= 1 && y <= side && z >= 1 && z <= side;
}

// Two hollow boxes and a speck. The first box, of 18^3 samples, has two cavities. The second, of 14^3
// samples, has one cavity, which contains a grain of 5^3 samples with a pore. The speck is a single sample.
Mesh boxes() {
    const Volume volume = solid(grid(40, 20, 20), [](auto x, auto y, auto z) {
        if (x == 38 && y == 18 && z == 18) return true;
        if (in_box(1, 18, x, y, z)) {
            const bool small = x >= 3 && x <= 4 && y == 5 && z == 5,
                       large = x >= 8 && x <= 13 && y == 9 && z == 9;
            return !small && !large;
        }
        const bool hollow = x >= 23 && x <= 31 && y >= 4 && y <= 12 && z >= 4 && z <= 12;
        const bool grain = x >= 25 && x <= 29 && y >= 6 && y <= 10 && z >= 6 && z <= 10;
        const bool pore = x == 27 && y == 8 && z == 8;
        return (in_box(20, 14, x, y, z) && !hollow) || (grain && !pore);
    });
    return extract_isosurface(volume, 0.5);
}

struct Kept {
    std::int64_t components;
    double volume;
    bool operator==(const Kept&) const = default;
};

Kept kept(const Mesh& mesh, const ComponentOptions& options) {
    const Mesh result = keep_components(mesh, options);
    EXPECT_EQ(manifold_fault(result), "");
    EXPECT_EQ(result.normals.size(), result.points.size());
    const MeshMeasures m = measure(result);
    return {m.components, m.volume};
}

TEST(KeepComponents, CountsComponentsAndKeepsTheirCavities) {
    const Mesh all = boxes();
    ASSERT_EQ(measure(all).components, 8);
    EXPECT_EQ(kept(all, {}).components, 8);
    EXPECT_EQ(kept(all, {.count = 9}).components, 8);
    EXPECT_EQ(kept(all, {.count = 1}).components, 3) << "the large box and its two cavities";
    EXPECT_EQ(kept(all, {.count = 2}).components, 5)
        << "also the other box and its cavity, without the grain";
    EXPECT_EQ(kept(all, {.count = 3}).components, 7) << "also the grain with its pore";
    EXPECT_EQ(kept(all, {.cavities = false}).components, 3)
        << "the boxes and the speck: the grain is filled in";
    EXPECT_EQ(kept(all, {.count = 2, .cavities = false}).components, 2);
    EXPECT_EQ(kept(all, kLargestAlone).components, 1);
}

// Bodies in a cavity that is filled would count twice.
TEST(KeepComponents, FillsCavitiesWithAllThatIsInThem) {
    const Mesh all = boxes();
    const Volume filled = solid(grid(40, 20, 20), [](auto x, auto y, auto z) {
        return (x == 38 && y == 18 && z == 18) || in_box(1, 18, x, y, z) || in_box(20, 14, x, y, z);
    });
    EXPECT_NEAR(kept(all, {.cavities = false}).volume, measure(extract_isosurface(filled, 0.5)).volume, 1e-3);
}

// Two dark balls in bright surroundings that end with the volume, so that nothing is around them.
TEST(KeepComponents, TakesWhatFacesInwardWithoutAnythingAroundForABody) {
    const Volume volume = solid(grid(30, 12, 12), [](auto x, auto y, auto z) {
        const auto ball = [&](auto cx, auto r) {
            return (x - cx) * (x - cx) + (y - 6) * (y - 6) + (z - 6) * (z - 6) <= r * r;
        };
        return !ball(6, 4) && !ball(20, 3);
    });
    const Mesh open = extract_isosurface(volume, 0.5);
    ASSERT_EQ(measure(open).cavities, 2);
    EXPECT_EQ(measure(keep_components(open, {.cavities = false})).components, 2);
    const Mesh largest = keep_components(open, kLargestAlone);
    EXPECT_EQ(measure(largest).components, 1);
    for (const Vec3f& p : largest.points) EXPECT_LT(p[0], 12);
}

// The boxes reach the end of the volume, where their surfaces are open.
TEST(KeepComponents, KeepsTheCavitiesOfOpenComponents) {
    const Volume volume = solid(grid(30, 16, 16), [](auto x, auto y, auto z) {
        const bool hole =
            y >= 6 && y <= 8 && z >= 6 && z <= 8 && ((x >= 5 && x <= 7) || (x >= 21 && x <= 22));
        return y >= 2 && y <= 12 && z <= 12 && ((x >= 1 && x <= 13) || (x >= 17 && x <= 26)) && !hole;
    });
    const Mesh open = extract_isosurface(volume, 0.5);
    ASSERT_GT(measure(open).boundary_edges, 0);
    ASSERT_EQ(measure(open).cavities, 2);
    const Mesh largest = keep_components(open, {.count = 1});
    EXPECT_EQ(measure(largest).components, 2);
    EXPECT_EQ(measure(largest).cavities, 1);
    for (const Vec3f& p : largest.points) EXPECT_LT(p[0], 15);
    EXPECT_EQ(measure(keep_components(open, {.count = 9})).cavities, 2);
}

TEST(KeepComponents, DropsComponentsBelowTheVolume) {
    const Mesh all = boxes();
    // A single sample's octahedron encloses 1/6 mm^3, two in a row 2/3, six 8/3.
    EXPECT_EQ(kept(all, {.min_volume = 0.16}).components, 8);
    EXPECT_EQ(kept(all, {.min_volume = 0.17}).components, 6) << "without the speck and the pore";
    EXPECT_EQ(kept(all, {.min_volume = 1}).components, 5);
    EXPECT_EQ(kept(all, {.min_volume = 4}).components, 4);
    EXPECT_EQ(kept(all, {.min_volume = 1e9}).components, 0);
    EXPECT_GT(kept(all, {.min_volume = 4}).volume, measure(all).volume) << "filled cavities add to a solid";
}

TEST(KeepComponents, KeepsOpenComponentsAndDropsUnusedPoints) {
    Mesh sheet;
    sheet.points = {{9, 9, 9}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    sheet.triangles = {{1, 3, 2}};
    const Mesh result = keep_components(sheet, {.min_volume = 5, .cavities = false});
    EXPECT_TRUE(result.points == (Buffer<Vec3f>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
    EXPECT_TRUE(result.triangles == (Buffer<Triangle>{{0, 2, 1}}));
}

// Triangles that share edges in any number and orientation, also with themselves.
Mesh tangle(std::uint32_t points, std::size_t triangles, Random& random) {
    Mesh mesh;
    for (std::uint32_t p = 0; p < points; ++p) {
        const float x = static_cast<float>(p);
        mesh.points.push_back({x, std::sin(x), std::cos(x)});
    }
    std::uniform_int_distribution<std::uint32_t> any(0, points - 1), near(0, 3);
    for (std::size_t t = 0; t < triangles; ++t) {
        const std::uint32_t p = any(random);
        const auto neighbour = [&] { return std::min(p + near(random), points - 1); };
        mesh.triangles.push_back({p, neighbour(), neighbour()});
    }
    return mesh;
}

TEST(Measure, CountsTheEdgesAndComponentsOfAnyTriangles) {
    Random random(7);
    for (const auto& [points, triangles] :
         {std::pair{12u, 5u}, {12u, 40u}, {100u, 60u}, {40000u, 30000u}, {40000u, 12000u}}) {
        const Mesh mesh = tangle(points, triangles, random);
        struct Directions {
            int up = 0, down = 0;
        };
        std::map<std::pair<std::uint32_t, std::uint32_t>, Directions> edges;
        std::vector<std::uint32_t> lowest(points);
        std::iota(lowest.begin(), lowest.end(), 0u);
        std::vector<bool> used(points, false);
        for (bool any_changed = true; std::exchange(any_changed, false);) {
            for (const Triangle& t : mesh.triangles) {
                const std::uint32_t least = std::min({lowest[t[0]], lowest[t[1]], lowest[t[2]]});
                for (const std::uint32_t p : t) any_changed |= std::exchange(lowest[p], least) != least;
            }
        }
        for (const Triangle& t : mesh.triangles) {
            for (std::size_t c = 0; c < 3; ++c) {
                const std::uint32_t a = t[c], b = t[(c + 1) % 3];
                Directions& edge = edges[{std::min(a, b), std::max(a, b)}];
                ++(a < b ? edge.up : edge.down);
                used[a] = true;
            }
        }
        std::int64_t boundary = 0, manifold = 0, components = 0;
        for (const auto& [ends, edge] : edges) {
            boundary += edge.up + edge.down == 1;
            manifold += edge.up == 1 && edge.down == 1;
        }
        for (std::uint32_t p = 0; p < points; ++p) components += used[p] && lowest[p] == p;

        const MeshMeasures m = measure(mesh);
        const auto all = static_cast<std::int64_t>(edges.size());
        EXPECT_EQ(m.boundary_edges, boundary);
        EXPECT_EQ(m.nonmanifold_edges, all - boundary - manifold);
        EXPECT_EQ(m.euler_characteristic, m.points - all + m.triangles);
        EXPECT_EQ(m.components, components);
    }
}

TEST(Measure, HasNoBoundsWhereAllCoordinatesAreNan) {
    const float nan = std::nanf("");
    Mesh mesh;
    mesh.points = {{nan, 1, 2}, {nan, 4, 3}, {nan, 2, nan}};
    const MeshMeasures m = measure(mesh);
    EXPECT_TRUE(std::isnan(m.lower[0]) && std::isnan(m.upper[0]));
    EXPECT_EQ(m.lower[1], 1);
    EXPECT_EQ(m.upper[1], 4);
    EXPECT_EQ(m.lower[2], 2);
    EXPECT_EQ(m.upper[2], 3);
}

TEST(Measure, HasTheSameAreaAndVolumeBesideAFirstPointWithoutTriangles) {
    const Volume volume = sampled_in_space<float>(grid(21, 21, 21), sphere({10, 10, 10}, 8));
    const Mesh ball = extract_isosurface(volume, 0);
    Mesh beside;
    beside.points.push_back({1e15f, 0, 0});
    beside.points.insert(beside.points.end(), ball.points.begin(), ball.points.end());
    for (const auto& [a, b, c] : ball.triangles) beside.triangles.push_back({a + 1, b + 1, c + 1});
    EXPECT_EQ(area_and_volume(beside).area, area_and_volume(ball).area);
    EXPECT_EQ(area_and_volume(beside).volume, area_and_volume(ball).volume);
}

TEST(KeepComponents, RejectsInvalidInput) {
    Mesh nowhere;
    nowhere.points = {{0, 0, 0}, {1, 0, 0}, {0, std::nanf(""), 0}};
    nowhere.triangles = {{0, 1, 2}};
    EXPECT_THROW(keep_components(nowhere, {}), InputError);
    Mesh broken;
    broken.triangles = {{0, 1, 2}};
    EXPECT_THROW(keep_components(broken, {}), InputError);
    Mesh half_lit = balls(5, 7);
    half_lit.normals.resize(1);
    EXPECT_THROW(keep_components(half_lit, {}), InputError);
    EXPECT_THROW(keep_components({}, {.count = 0}), InputError);
    EXPECT_THROW(keep_components({}, {.count = -1}), InputError);
    EXPECT_THROW(keep_components({}, {.min_volume = std::nan("")}), InputError);
    EXPECT_TRUE(keep_components({}, {.count = 1}).points.empty());
}

}  // namespace
}  // namespace marrow::test
