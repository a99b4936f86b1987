// Tests that simplify reaches its limits and keeps the topology.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include <marrow/error.h>
#include <marrow/isosurface.h>
#include <marrow/measure.h>
#include <marrow/mesh_check.h>
#include <marrow/simplify.h>

#include "mesh/connectivity/one_rings.h"
#include "mesh/find_components.h"
#include "support/fields.h"
#include "support/mesh_checks.h"

namespace marrow::test {
namespace {

Mesh ball(double radius) {
    const Volume volume = sampled_in_space<float>(grid(41, 41, 41), sphere({20, 20, 20}, radius));
    return extract_isosurface(volume, 0);
}

void expect_same_topology(const Mesh& before, const Mesh& after) {
    const MeshMeasures a = measure(before), b = measure(after);
    EXPECT_EQ(a.components, b.components);
    EXPECT_EQ(a.euler_characteristic, b.euler_characteristic);
    EXPECT_EQ(a.boundary_edges, b.boundary_edges);
}

TEST(Simplify, ReachesTheCountAndStaysNear) {
    const Mesh mesh = ball(15);
    for (const std::int64_t triangles : {4000, 1000, 100}) {
        SimplifyStats stats;
        const Mesh reduced = simplify(mesh, {.triangles = triangles}, &stats);
        EXPECT_EQ(manifold_fault(reduced), "");
        EXPECT_EQ(static_cast<std::int64_t>(reduced.triangles.size()), triangles);
        // The best n triangles are about 4 sqrt(3) pi r / (9 n) away from a sphere (Fejes Toth).
        const double best = 4 * std::sqrt(3) * M_PI * 15 / (9 * static_cast<double>(triangles));
        EXPECT_LT(stats.deviation.mean, 2 * best);
        const MeshDistance again = mesh_distance(mesh, reduced);
        EXPECT_EQ(stats.deviation.max, again.max);
        EXPECT_EQ(stats.deviation.mean, again.mean);
        EXPECT_LT(triangles * std::abs(measure(reduced).volume / measure(mesh).volume - 1), 15);
    }
}

// Collapses that are undone, because the walls come to pass through each other, leave more than a fifth.
TEST(Simplify, ReachesTheCountWhereWallsAreThin) {
    const Volume bowls = sampled<float>(grid(41, 41, 41), [](auto x, auto y, auto z) {
        const double wave =
            std::sin(1.3 * static_cast<double>(x)) * std::sin(1.1 * static_cast<double>(y) + z);
        const Vec3d from_centre{x - 20.0, y - 20.0, z - 20.0};
        return 1 - std::abs(length(from_centre) - 15 + wave);
    });
    const Mesh mesh = extract_isosurface(bowls, 0);
    ASSERT_EQ(check_mesh(mesh).self_intersections, 0);
    const auto wanted = static_cast<std::int64_t>(mesh.triangles.size()) / 10;
    const Mesh reduced = simplify(mesh, {.triangles = wanted});
    EXPECT_LE(static_cast<std::int64_t>(reduced.triangles.size()), wanted);
    EXPECT_EQ(manifold_fault(reduced), "");
    EXPECT_EQ(check_mesh(reduced).self_intersections, 0);
    expect_same_topology(mesh, reduced);
}

TEST(Simplify, ReducesABoxToItsFlatSides) {
    const Volume solid = sampled<float>(grid(30, 30, 30), [](auto x, auto y, auto z) {
        return x > 4 && x < 25 && y > 4 && y < 25 && z > 4 && z < 25 ? 1 : -1;
    });
    const Mesh mesh = extract_isosurface(solid, 0);
    const Mesh reduced = simplify(mesh, {.max_error = 0.02});
    EXPECT_EQ(manifold_fault(reduced), "");
    EXPECT_LT(reduced.triangles.size(), 200u) << "of " << mesh.triangles.size();
    EXPECT_NEAR(measure(reduced).volume, measure(mesh).volume, 1e-3 * measure(mesh).volume);
}

TEST(Simplify, KeepsTheAllowedError) {
    Random random(3);
    const auto field = torus({20, 20, 20}, 11, 5);
    const Volume rough = sampled_in_space<float>(grid(41, 41, 41), [&](const Vec3d& p) {
        return field(p) + std::normal_distribution<double>(0, 0.3)(random);
    });
    const Mesh mesh = extract_isosurface(rough, 0);
    std::size_t before = mesh.triangles.size() + 1;
    for (const double max_error : {0.02, 0.1, 0.5}) {
        SimplifyStats stats;
        const Mesh reduced = simplify(mesh, {.max_error = max_error}, &stats);
        EXPECT_LE(mesh_distance(mesh, reduced).max, max_error);
        EXPECT_EQ(manifold_fault(reduced), "");
        expect_same_topology(mesh, reduced);
        EXPECT_LT(reduced.triangles.size(), before);
        before = reduced.triangles.size();
    }
    EXPECT_LT(before, mesh.triangles.size() / 5);
}

TEST(Simplify, KeepsTheAllowedErrorInRegionsOnAnyNumberOfThreads) {
    const auto field = torus({80, 80, 35}, 50, 24);
    const Volume wavy = sampled_in_space<float>(
        grid(161, 161, 71), [&](const Vec3d& p) { return field(p) + 0.3 * std::sin(p[0] + 2 * p[1]); });
    const Mesh mesh = extract_isosurface(wavy, 0);
    ASSERT_GT(mesh.points.size(), 70'000u);  // enough for several regions
    SimplifyStats one, more;
    const Mesh reduced = simplify(mesh, {.max_error = 0.1, .threads = 1}, &one);
    EXPECT_EQ(mesh_hash(simplify(mesh, {.max_error = 0.1, .threads = 3}, &more)), mesh_hash(reduced));
    EXPECT_EQ(more.deviation.mean, one.deviation.mean);
    EXPECT_EQ(more.undone_collapses, one.undone_collapses);
    EXPECT_LE(mesh_distance(mesh, reduced).max, 0.1);
    EXPECT_EQ(manifold_fault(reduced), "");
    EXPECT_EQ(check_mesh(reduced).self_intersections, 0);
    expect_same_topology(mesh, reduced);
    EXPECT_LT(reduced.triangles.size(), mesh.triangles.size() / 2);
}

TEST(Simplify, StopsAtTheCountWithinTheError) {
    const Mesh mesh = ball(15);
    const Mesh both = simplify(mesh, {.triangles = 5000, .max_error = 0.5});
    EXPECT_EQ(both.triangles.size(), 5000u);
}

TEST(Simplify, KeepsEveryComponentAndHandle) {
    Random random(11);
    for (int trial = 0; trial < 15; ++trial) {
        const RandomGrid random_one = random_grid(random);
        const Mesh mesh = extract_isosurface(random_one.volume, random_one.isovalue, {.closed = true});
        if (mesh.triangles.empty()) continue;
        const Mesh reduced = simplify(mesh, {.triangles = 4});
        ASSERT_EQ(manifold_fault(reduced), "") << "trial " << trial;
        expect_same_topology(mesh, reduced);
    }
}

// The volumes of components, in the order of their lowest points, which reduction keeps.
std::vector<double> component_volumes(const Mesh& mesh) {
    std::vector<double> volumes;
    for (const internal::Component& c : internal::find_components(mesh, internal::OneRings(mesh)).all)
        volumes.push_back(c.volume);
    return volumes;
}

TEST(Simplify, TurnsNoSpeckInsideOut) {
    Random random(3);
    std::uniform_real_distribution<double> unit(-1, 1);
    std::int64_t cavities = 0;
    for (int trial = 0; trial < 20; ++trial) {
        const Volume noise =
            sampled_in_space<float>(grid(12, 12, 12), [&](const Vec3d&) { return unit(random); });
        const Mesh mesh = extract_isosurface(noise, trial % 2 == 0 ? 0.7 : -0.7, {.closed = true});
        const std::vector<double> before = component_volumes(mesh);
        for (const SimplifyOptions& options :
             {SimplifyOptions{.triangles = 0}, SimplifyOptions{.max_error = 0.5}}) {
            const std::vector<double> after = component_volumes(simplify(mesh, options));
            ASSERT_EQ(after.size(), before.size());
            for (std::size_t c = 0; c < before.size(); ++c) {
                EXPECT_EQ(after[c] > 0, before[c] > 0) << before[c] << ", " << after[c];
                cavities += before[c] < 0 ? 1 : 0;
            }
        }
    }
    EXPECT_GT(cavities, 20);
}

TEST(Simplify, KeepsBordersAndNonManifoldEdges) {
    const Volume volume = sampled_in_space<float>(grid(20, 20, 20), sphere({10, 10, 0}, 8.2));
    const Mesh half = extract_isosurface(volume, 0);
    const Mesh reduced = simplify(half, {.triangles = 100});
    EXPECT_EQ(manifold_fault(reduced, true), "");
    expect_same_topology(half, reduced);
    EXPECT_LT(reduced.triangles.size(), half.triangles.size() / 4);

    Mesh twice = half;  // every edge has four triangles
    twice.triangles.insert(twice.triangles.end(), half.triangles.begin(), half.triangles.end());
    EXPECT_EQ(simplify(twice, {.triangles = 100}).triangles.size(), twice.triangles.size());
}

TEST(Simplify, WithoutLimitsGoesOnUntilNoEdgeCanBeCollapsed) {
    const Mesh mesh = ball(5);
    EXPECT_EQ(mesh_hash(simplify(mesh, {})), mesh_hash(simplify(mesh, {.triangles = 0})));
    EXPECT_LT(simplify(mesh, {}).triangles.size(), 30u);
}

// A power of two changes no bit of a coordinate but its exponent.
TEST(Simplify, DoesTheSameInAnyUnitOfLength) {
    const Mesh mesh = ball(8);
    SimplifyStats stats, scaled_stats;
    const Mesh reduced = simplify(mesh, {.triangles = 200, .max_error = 0.5}, &stats);
    for (const int power : {-100, -40, -20, 20, 40, 120}) {
        Mesh scaled = mesh;
        for (Vec3f& p : scaled.points)
            for (float& x : p) x = std::ldexp(x, power);
        Mesh result =
            simplify(scaled, {.triangles = 200, .max_error = std::ldexp(0.5, power)}, &scaled_stats);
        for (Vec3f& p : result.points)
            for (float& x : p) x = std::ldexp(x, -power);
        EXPECT_TRUE(result.points == reduced.points);
        EXPECT_TRUE(result.triangles == reduced.triangles);
        EXPECT_EQ(std::ldexp(scaled_stats.deviation.max, -power), stats.deviation.max);
        EXPECT_EQ(std::ldexp(scaled_stats.deviation.mean, -power), stats.deviation.mean);
    }
}

TEST(Simplify, DoesTheSameBesideAPointWithoutTriangles) {
    const Mesh mesh = ball(8);
    const Mesh reduced = simplify(mesh, {.triangles = 200, .max_error = 0.5});
    Mesh beside = mesh;
    beside.points.push_back({1e30f, 0, 0});
    beside.normals.push_back({1, 0, 0});
    EXPECT_EQ(mesh_hash(simplify(beside, {.triangles = 200, .max_error = 0.5})), mesh_hash(reduced));
}

TEST(Simplify, ProgressRisesToOne) {
    const Mesh mesh = ball(8);
    for (const double share : {0.5, 0.05}) {
        double last = 0;
        simplify(mesh,
                 {.triangles = static_cast<std::int64_t>(share * static_cast<double>(mesh.triangles.size())),
                  .progress = [&](double fraction) {
                      EXPECT_GE(fraction, last);
                      last = fraction;
                      return true;
                  }});
        EXPECT_EQ(last, 1) << share;
    }
}

TEST(Simplify, RejectsInvalidInputAndCanBeCancelled) {
    const Mesh mesh = ball(5);
    EXPECT_THROW(simplify(mesh, {.triangles = -1}), InputError);
    EXPECT_THROW(simplify(mesh, {.max_error = 0}), InputError);
    EXPECT_THROW(simplify(mesh, {.max_error = std::nan("")}), InputError);
    for (const float x : {std::nanf(""), INFINITY}) {
        Mesh wrong = mesh;
        wrong.points[3][2] = x;
        EXPECT_THROW(simplify(wrong, {.triangles = 9}), InputError);
    }
    EXPECT_THROW(simplify(mesh, {.triangles = 9, .progress = [](double) { return false; }}), Cancelled);
    EXPECT_TRUE(simplify({}, {}).points.empty());
}

}  // namespace
}  // namespace marrow::test
