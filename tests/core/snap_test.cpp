// Tests that snapped surfaces are manifolds of the same topology as the unsnapped ones, close to them, and
// without slivers.
#include <gtest/gtest.h>

#include <hwy/targets.h>

#include <algorithm>
#include <cstdlib>

#include <marrow/error.h>
#include <marrow/isosurface.h>
#include <marrow/measure.h>
#include <marrow/mesh_check.h>
#include <marrow/streaming.h>

#include "support/fields.h"
#include "support/mesh_checks.h"

namespace marrow::test {
namespace {

Mesh snapped(const VolumeView& volume, double isovalue, double snap, bool closed, int threads = 1) {
    return extract_isosurface(volume, isovalue, {.closed = closed, .snap = snap, .threads = threads});
}

Mesh unsnapped(const VolumeView& volume, double isovalue, bool closed) {
    return extract_isosurface(volume, isovalue, {.closed = closed, .threads = 1});
}

// Waves with bumps, thin walls and points exactly at samples.
template <class T>
Volume rough_ground(const Geometry& g) {
    return sampled<T>(g, [](auto x, auto y, auto z) {
        return 60 +
               40 * std::sin(0.2 * static_cast<double>(x) + 0.1 * static_cast<double>(z)) *
                   std::cos(0.31 * static_cast<double>(y)) +
               static_cast<double>((x * 7919 + y * 104729 + z * 1299709) % 23);
    });
}

class SnappedRandomGrids : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Seeds, SnappedRandomGrids, testing::Range(0, 10));

// 10 x 1,000 grids of noise, ties and extreme values. Nearly every cell of these could break a rule of
// snapping.
TEST_P(SnappedRandomGrids, AreManifoldsOfTheSameTopology) {
    Random random(static_cast<std::uint64_t>(GetParam()));
    for (int i = 0; i < 1000; ++i) {
        const RandomGrid g = random_grid(random);
        for (const bool closed : {true, false}) {
            const MeshMeasures before = measure(unsnapped(g.volume, g.isovalue, closed));
            for (const double snap : {0.05, 0.3, 0.49}) {
                const Mesh mesh = snapped(g.volume, g.isovalue, snap, closed);
                ASSERT_EQ(manifold_fault(mesh, !closed), "") << "grid " << i << " snap " << snap << closed;
                const MeshMeasures after = measure(mesh);
                ASSERT_EQ(after.components, before.components) << "grid " << i << " snap " << snap << closed;
                ASSERT_EQ(after.euler_characteristic, before.euler_characteristic)
                    << "grid " << i << " snap " << snap;
                ASSERT_LE(after.points, before.points);
                for (const auto* vectors : {&mesh.points, &mesh.normals}) {
                    for (const Vec3f& v : *vectors)
                        ASSERT_TRUE(std::isfinite(v[0] + v[1] + v[2])) << "grid " << i;
                }
            }
        }
    }
}

// Each triangle moves by no more than its corners do.
TEST_P(SnappedRandomGrids, StayWithinTheLimitOfTheSurface) {
    Random random(static_cast<std::uint64_t>(100 + GetParam()));
    for (int i = 0; i < 60; ++i) {
        const RandomGrid g = random_grid(random);
        VolumeView volume(g.volume);
        volume.geometry.spacing = {0.5, 1, 2};
        for (const bool closed : {true, false}) {
            const Mesh before = unsnapped(volume, g.isovalue, closed);
            if (before.triangles.empty()) continue;
            for (const double snap : {0.1, 0.3, 0.49}) {
                const Mesh after = snapped(volume, g.isovalue, snap, closed);
                ASSERT_LE(mesh_distance(before, after, {.samples = 2000}).max, snap * 2 + 1e-5)
                    << "grid " << i << " snap " << snap;
            }
        }
    }
}

// The border of an open surface stays on the box of the volume.
TEST(Snap, KeepsTheBorderOnTheBox) {
    Random random(5);
    for (int i = 0; i < 1000; ++i) {
        const RandomGrid g = random_grid(random);
        const Mesh mesh = snapped(g.volume, g.isovalue, 0.3, false);
        std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
        for (const Triangle& t : mesh.triangles) {
            for (std::size_t c = 0; c < 3; ++c) ++edges[std::minmax(t[c], t[(c + 1) % 3])];
        }
        const auto& dims = g.volume.geometry().dims;
        for (const auto& [edge, triangles] : edges) {
            if (triangles == 2) continue;
            bool in_face = false;
            for (std::size_t a = 0; a < 3; ++a) {
                for (const float end : {0.0f, static_cast<float>(dims[a] - 1)})
                    in_face |= mesh.points[edge.first][a] == end && mesh.points[edge.second][a] == end;
            }
            ASSERT_TRUE(in_face) << "grid " << i;
        }
    }
}

TEST(Snap, SmoothSurfacesLoseAThirdOfTheirPointsAndAllSlivers) {
    const Volume ball = sampled_in_space<float>(grid(60, 60, 60), sphere({29.3, 29.6, 29.8}, 25));
    const Volume ring = sampled_in_space<float>(grid(60, 60, 30), torus({29.3, 29.6, 14.8}, 18, 8));
    for (const Volume* volume : {&ball, &ring}) {
        const Mesh before = unsnapped(*volume, 0, true), after = snapped(*volume, 0, 0.3, true);
        EXPECT_LT(triangle_quality(before).smallest_angle, 1);
        EXPECT_GE(triangle_quality(after).smallest_angle, 5);
        EXPECT_LE(static_cast<double>(after.points.size()), 0.7 * static_cast<double>(before.points.size()));
        EXPECT_LE(roughness(after, 3).roughness, roughness(before, 3).roughness);
        EXPECT_NEAR(measure(after).volume, measure(before).volume, 0.003 * measure(before).volume);
        EXPECT_LT(mesh_distance(before, after, {.samples = 20000}).mean, 0.01)
            << "merged points are on the surface";
    }
}

TEST(Snap, NoTriangleHasTwoCornersAtOnePosition) {
    Random random(9);
    for (int i = 0; i < 2000; ++i) {
        const RandomGrid g = random_grid(random);
        const Mesh mesh = snapped(g.volume, g.isovalue, 0.3, true);
        for (const Triangle& t : mesh.triangles) {
            for (std::size_t c = 0; c < 3; ++c)
                ASSERT_NE(bits_of(mesh.points[t[c]]), bits_of(mesh.points[t[(c + 1) % 3]])) << "grid " << i;
        }
    }
}

TEST(Snap, NormalsAreUnitAndPointOutside) {
    const Vec3d centre{29.3, 29.6, 29.8};
    Geometry g = grid(60, 60, 60);
    for (const double mirror : {1.0, -1.0}) {
        g.direction[0][0] = mirror;
        const Vec3d mirrored_centre{mirror * centre[0], centre[1], centre[2]};
        const Volume volume = sampled_in_space<float>(g, sphere(mirrored_centre, 25));
        const Mesh mesh = snapped(volume, 0, 0.3, true);
        EXPECT_GT(measure(mesh).volume, 0);
        for (std::size_t i = 0; i < mesh.points.size(); ++i) {
            double outward = 0, squared = 0;
            for (std::size_t a = 0; a < 3; ++a) {
                const double n = mesh.normals[i][a];
                outward += (static_cast<double>(mesh.points[i][a]) - mirrored_centre[a]) * n;
                squared += n * n;
            }
            ASSERT_NEAR(squared, 1, 1e-5);
            ASSERT_GT(outward, 24.5);
        }
    }
}

// 130 slices make several slabs.
TEST(Snap, SameBytesForAnyThreadsAndSimdTarget) {
    const Volume volume = rough_ground<std::int16_t>(grid(90, 40, 130));
    for (const bool closed : {false, true}) {
        const Mesh mesh = snapped(volume, 66.5, 0.3, closed);
        ASSERT_EQ(manifold_fault(mesh, !closed), "");
        const std::uint64_t hash = mesh_hash(mesh);
        for (const int threads : {2, 3, 7, 0})
            EXPECT_EQ(mesh_hash(snapped(volume, 66.5, 0.3, closed, threads)), hash);
        const std::int64_t supported = hwy::SupportedTargets();
        for (std::int64_t left = supported; left != 0; left &= left - 1) {
            hwy::SetSupportedTargetsForTest(left & -left);
            hwy::GetChosenTarget().Update(hwy::SupportedTargets());
            EXPECT_EQ(mesh_hash(snapped(volume, 66.5, 0.3, closed)), hash) << hwy::TargetName(left & -left);
        }
        hwy::SetSupportedTargetsForTest(0);
        hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    }
}

TEST(Snap, ExtractorGivesTheSameBytes) {
    const Volume volume = rough_ground<float>(grid(50, 40, 70));
    const IsosurfaceOptions options{.closed = true, .snap = 0.3};
    IsosurfaceExtractor extractor(volume, options);
    extractor.extract(50);
    EXPECT_EQ(mesh_hash(extractor.extract(66.5)), mesh_hash(extract_isosurface(volume, 66.5, options)));
}

TEST(Snap, ShearedAndAnisotropicGridsStayManifolds) {
    Geometry g = grid(40, 40, 20);
    g.spacing = {0.4, 0.5, 3};
    g.origin = {-900, 800, 1200};
    g.direction = {{{1, 0, 0}, {0, 1, 0.316}, {0, 0, 0.949}}};
    const Volume volume = rough_ground<float>(g);
    const Mesh before = unsnapped(volume, 66.5, true), after = snapped(volume, 66.5, 0.3, true);
    EXPECT_EQ(manifold_fault(after), "");
    EXPECT_EQ(check_mesh(after).self_intersections, 0);
    EXPECT_LT(after.points.size(), 4 * before.points.size() / 5);
    EXPECT_LE(mesh_distance(before, after, {.samples = 20000}).max, 0.3 * 3 + 1e-3);
}

// Points 200 m away are multiples of 1/64 mm, more than an edge: no exception makes the surface valid.
TEST(Snap, RefusesCoordinatesThatFloatCannotHold) {
    Geometry g = grid(10, 10, 10);
    g.spacing = {0.01, 0.01, 0.01};
    g.origin = {2e5, 2e5, 2e5};
    Random random(1);
    std::normal_distribution<double> value;
    const Volume volume = sampled<float>(g, [&](auto, auto, auto) { return value(random); });
    EXPECT_THROW(snapped(volume, 0, 0.3, true), GeometryError);
}

TEST(Snap, LimitOfZeroDoesNotSnap) {
    const Volume volume = rough_ground<float>(grid(30, 30, 30));
    EXPECT_EQ(mesh_hash(snapped(volume, 66.5, 0, true)), mesh_hash(unsnapped(volume, 66.5, true)));
}

TEST(Snap, RefusesLimitsOutOfRangeAndStreaming) {
    const Volume volume = checkerboard(4);
    for (const double snap : {-0.1, 0.5, 2.0, std::nan("")}) {
        EXPECT_THROW(snapped(volume, 0.5, snap, true), InputError);
        EXPECT_THROW(IsosurfaceExtractor(volume, {.snap = snap}), InputError);
    }
    const SliceSource source{volume.geometry(), volume.type(), [](auto, auto, auto) {}};
    const SurfaceSink sink{[](auto, auto, auto) {}, [](auto) {}};
    EXPECT_THROW(extract_isosurface_in_slabs(source, 0.5, sink, {}, {.snap = 0.3}), InputError);
}

TEST(Snap, ReportsProgressToTheEnd) {
    const Volume volume = rough_ground<float>(grid(40, 40, 40));
    double last = 0;
    const auto progress = [&](double done) {
        EXPECT_GT(done, last - 1e-9);
        last = done;
        return true;
    };
    extract_isosurface(volume, 66.5, {.closed = true, .snap = 0.3, .progress = progress});
    EXPECT_EQ(last, 1);
}

TEST(Snap, CanBeCancelled) {
    const Volume volume = rough_ground<float>(grid(60, 60, 200));
    const IsosurfaceOptions options{
        .closed = true, .snap = 0.3, .progress = [](double done) { return done < 0.8; }};
    EXPECT_THROW(extract_isosurface(volume, 66.5, options), Cancelled);
}

}  // namespace
}  // namespace marrow::test
