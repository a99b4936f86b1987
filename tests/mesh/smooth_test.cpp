// Tests that smooth removes steps and keeps volume, borders and specks.
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include <marrow/error.h>
#include <marrow/isosurface.h>
#include <marrow/measure.h>
#include <marrow/smooth.h>

#include "support/fields.h"
#include "support/mesh_checks.h"

namespace marrow::test {
namespace {

// The surface of a binary ball, which has steps.
Mesh stepped_ball(double radius) {
    const auto field = sphere({20, 20, 20}, radius);
    const Volume volume =
        sampled_in_space<std::uint8_t>(grid(41, 41, 41), [&](const Vec3d& p) { return field(p) > 0; });
    return extract_isosurface(volume, 0.5);
}

double change(double before, double after) {
    return std::abs(after / before - 1);
}

TEST(Smooth, RemovesStepsWithoutShrinking) {
    const Mesh stepped = stepped_ball(15.3);
    const Mesh smoothed = smooth(stepped);
    EXPECT_EQ(manifold_fault(smoothed), "");
    EXPECT_TRUE(smoothed.triangles == stepped.triangles);
    EXPECT_LT(roughness(smoothed, 3).roughness, 0.2 * roughness(stepped, 3).roughness);
    EXPECT_LT(change(measure(stepped).volume, measure(smoothed).volume), 0.002);
    const double true_area = 4 * M_PI * 15.3 * 15.3;
    EXPECT_LT(change(true_area, measure(smoothed).area), 0.02);
    EXPECT_GT(change(true_area, measure(stepped).area), 0.05);
    const Mesh thirty_times = smooth(stepped, {.iterations = 600});
    EXPECT_LT(change(measure(stepped).volume, measure(thirty_times).volume), 0.005);
}

TEST(Smooth, BarelyMovesASmoothSurface) {
    const Volume ball = sampled_in_space<float>(grid(41, 41, 41), sphere({20, 20, 20}, 15));
    const Mesh mesh = extract_isosurface(ball, 0);
    const MeshDistance moved = mesh_distance(mesh, smooth(mesh), {.samples = 20000});
    EXPECT_LT(moved.max, 0.1);
    EXPECT_LT(moved.mean, 0.01);
}

TEST(Smooth, KeepsPointsWithinHalfASampleIfBound) {
    Geometry g = grid(24, 24, 12);
    g.spacing = {1, 0.5, 3};
    g.direction = {{{0, -1, 0}, {0.6, 0, 0.8}, {0.8, 0, -0.6}}};
    g.origin = {100, -50, 7};
    Random random(7);
    const Volume noise = sampled<float>(g, [&](auto x, auto y, auto z) {
        const bool inside = x > 3 && x < 20 && y > 3 && y < 20 && z > 2 && z < 9;
        return (inside ? 1.0 : -1.0) + std::normal_distribution<double>(0, 0.7)(random);
    });
    const Mesh mesh = extract_isosurface(noise, 0, {.closed = true});
    const auto farthest = [&](const Mesh& smoothed) {  // in samples
        double most = 0;
        for (std::size_t p = 0; p < mesh.points.size(); ++p) {
            for (std::size_t a = 0; a < 3; ++a) {
                double along = 0;  // the direction is orthogonal
                for (std::size_t r = 0; r < 3; ++r)
                    along += g.direction[r][a] * (double{smoothed.points[p][r]} - double{mesh.points[p][r]});
                most = std::max(most, std::abs(along) / g.spacing[a]);
            }
        }
        return most;
    };
    EXPECT_GT(farthest(smooth(mesh, {.iterations = 50})), 0.6);
    const Mesh bound = smooth(mesh, {.iterations = 50, .bound = g.index_to_physical()});
    EXPECT_LT(farthest(bound), 0.5 + 1e-4);
    EXPECT_GT(farthest(bound), 0.49);
    EXPECT_EQ(manifold_fault(bound), "");
}

TEST(Smooth, KeepsSpecksFromVanishing) {
    const Volume speck = sampled<float>(
        grid(5, 5, 5), [](auto x, auto y, auto z) { return x == 2 && y == 2 && z == 2 ? 1 : -1; });
    const Mesh mesh = extract_isosurface(speck, 0);
    SmoothStats stats;
    const Mesh smoothed = smooth(mesh, {}, &stats);
    EXPECT_EQ(stats.restored_components, 1);
    EXPECT_TRUE(smoothed.points == mesh.points);
}

// All its points are on borders, which do not move.
TEST(Smooth, CountsNoPointsThatCouldNotMoveAsHeldBack) {
    Mesh crossing;
    crossing.points = {{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {0.5, 0.5, -1}, {0.5, 0.5, 1}, {1, 0.3f, 0.5}};
    crossing.triangles = {{0, 1, 2}, {3, 4, 5}};
    SmoothStats stats;
    EXPECT_TRUE(smooth(crossing, {}, &stats).points == crossing.points);
    EXPECT_EQ(stats.held_back_points, 0);
}

TEST(Smooth, DoesNotMoveBorders) {
    const Volume ball = sampled_in_space<float>(grid(20, 20, 20), sphere({10, 10, 0}, 8.2));
    const Mesh half = extract_isosurface(ball, 0);
    ASSERT_GT(measure(half).boundary_edges, 0);
    const Mesh smoothed = smooth(half);
    EXPECT_EQ(manifold_fault(smoothed, true), "");
    std::size_t border = 0;
    for (std::size_t p = 0; p < half.points.size(); ++p) {
        if (half.points[p][2] > 0) continue;
        ++border;
        EXPECT_EQ(half.points[p], smoothed.points[p]);
    }
    EXPECT_GT(border, 40u);
}

TEST(Smooth, ComputesOutwardUnitNormals) {
    const Mesh mesh = smooth(stepped_ball(12));
    ASSERT_EQ(mesh.normals.size(), mesh.points.size());
    for (std::size_t p = 0; p < mesh.points.size(); ++p) {
        double outward = 0, size = 0;
        for (std::size_t a = 0; a < 3; ++a) {
            outward += mesh.normals[p][a] * (mesh.points[p][a] - 20) / 12;
            size += double{mesh.normals[p][a]} * mesh.normals[p][a];
        }
        EXPECT_NEAR(size, 1, 1e-5);
        EXPECT_GT(outward, 0.9);
    }
}

// So that the filter can be cancelled between them.
TEST(Smooth, ReportsProgressInEachPass) {
    std::set<double> fractions;
    smooth(stepped_ball(5), {.iterations = 20, .progress = [&](double fraction) {
                                 fractions.insert(fraction);
                                 return true;
                             }});
    EXPECT_GE(fractions.size(), 20u);
}

TEST(Smooth, MovesNoPointToInfinity) {
    for (const float x : {1e30f, 3e38f}) {
        Mesh mesh = stepped_ball(5);
        mesh.points[7][1] = x;
        for (const Vec3f& p : smooth(mesh).points)
            EXPECT_TRUE(std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]));
    }
}

TEST(Smooth, RejectsInvalidInputAndCanBeCancelled) {
    const Mesh mesh = stepped_ball(5);
    EXPECT_THROW(smooth(mesh, {.iterations = -1}), InputError);
    EXPECT_THROW(smooth(mesh, {.pass_band = 0}), InputError);
    EXPECT_THROW(smooth(mesh, {.pass_band = 2}), InputError);
    EXPECT_THROW(smooth(mesh, {.max_move = -1}), InputError);
    EXPECT_THROW(smooth(mesh, {.pass_band = std::nan("")}), InputError);
    for (const int iterations : {0, 20})
        EXPECT_THROW(smooth(mesh, {.iterations = iterations, .bound = Mat3d{}}), InputError);
    for (const float x : {std::nanf(""), INFINITY}) {
        Mesh wrong = mesh;
        wrong.points[3][2] = x;
        EXPECT_THROW(smooth(wrong), InputError);
    }
    EXPECT_THROW(smooth(mesh, {.progress = [](double) { return false; }}), Cancelled);
    EXPECT_TRUE(smooth(mesh, {.iterations = 0}).points == mesh.points);
    EXPECT_TRUE(smooth({}).points.empty());
}

}  // namespace
}  // namespace marrow::test
