// Extracted surfaces: all sample types, sizes, isovalues and geometries.
#include <gtest/gtest.h>

#include <atomic>

#include <tbb/global_control.h>

#include <marrow/isosurface.h>
#include <marrow/measure.h>

#include "support/fields.h"
#include "support/mesh_checks.h"

namespace marrow::test {
namespace {

// Smooth and busy: several components and handles, sizes that are not multiples of 64.
Volume wobbly(std::int64_t nx, std::int64_t ny, std::int64_t nz) {
    return sampled<float>(grid(nx, ny, nz), [](auto x, auto y, auto z) {
        return std::sin(0.31 * static_cast<double>(x)) + std::sin(0.37 * static_cast<double>(y)) * 1.1 +
               std::sin(0.29 * static_cast<double>(z)) * 0.9;
    });
}

TEST(Isosurface, SameBytesForAnyNumberOfThreads) {
    // More threads than the machine may have, so that threads work on shares at the same time.
    const tbb::global_control threads_allowed(tbb::global_control::max_allowed_parallelism, 16);
    const Volume volume = wobbly(131, 67, 59);
    for (const bool closed : {false, true}) {
        const std::uint64_t one =
            mesh_hash(extract_isosurface(volume, 0.2, {.closed = closed, .threads = 1}));
        for (const int threads : {2, 3, 7, 16}) {
            EXPECT_EQ(mesh_hash(extract_isosurface(volume, 0.2, {.closed = closed, .threads = threads})), one)
                << threads;
        }
    }
}

TEST(Isosurface, SizesAroundTheWordAgreeWithTheClassicAlgorithm) {
    for (const std::int64_t nx : {1, 2, 3, 62, 63, 64, 65, 66, 126, 127, 128, 129, 190}) {
        const Volume volume = wobbly(nx, 9, 7);
        for (const bool closed : {false, true}) {
            const Mesh mesh = extract_isosurface(volume, 0.1, {.closed = closed});
            const Mesh classic = extract_isosurface_classic(volume, 0.1, closed);
            EXPECT_EQ(triangle_positions(mesh), triangle_positions(classic)) << nx;
            EXPECT_EQ(manifold_fault(mesh, !closed), "") << nx;
        }
    }
}

TEST(Isosurface, EverySampleTypeFindsTheSameSphere) {
    const auto value = [](const Vec3d& p) {
        return std::clamp(60 + 4 * sphere({15, 16, 17}, 10)(p), 0.0, 120.0);
    };
    const Geometry g = grid(31, 32, 33);
    const double truth = 4 * 3.14159265 * 1000 / 3;
    const Volume volumes[] = {
        sampled_in_space<std::uint8_t>(g, value),  sampled_in_space<std::int8_t>(g, value),
        sampled_in_space<std::uint16_t>(g, value), sampled_in_space<std::int16_t>(g, value),
        sampled_in_space<std::int32_t>(g, value),  sampled_in_space<float>(g, value),
        sampled_in_space<double>(g, value)};
    for (const Volume& volume : volumes) {
        // Integers are truncated, so they are half a unit too low on average, which is an eighth of a
        // millimetre.
        const bool integer = volume.type() != SampleType::float32 && volume.type() != SampleType::float64;
        const Mesh mesh = extract_isosurface(volume, integer ? 59.5 : 60.0);
        EXPECT_EQ(manifold_fault(mesh), "") << sample_type_name(volume.type());
        EXPECT_NEAR(measure(mesh).volume / truth, 1, 0.01) << sample_type_name(volume.type());
        for (std::size_t i = 0; i < mesh.points.size(); ++i) {
            const Vec3f& p = mesh.points[i];
            const Vec3d outward{(p[0] - 15) / 10.0, (p[1] - 16) / 10.0, (p[2] - 17) / 10.0};
            double cosine = 0;
            for (std::size_t a = 0; a < 3; ++a)
                cosine += outward[a] * static_cast<double>(mesh.normals[i][a]);
            ASSERT_GT(cosine, 0.97) << sample_type_name(volume.type());
        }
    }
}

TEST(Isosurface, EmptyFullAndThinVolumes) {
    for (const auto& dims : {std::array<std::int64_t, 3>{0, 0, 0},
                             {5, 0, 5},
                             {1, 1, 1},
                             {1, 5, 6},
                             {5, 1, 6},
                             {5, 6, 1},
                             {2, 2, 2},
                             {70, 3, 4}}) {
        const Geometry g = grid(dims[0], dims[1], dims[2]);
        const bool has_samples = g.sample_count() > 0;
        for (const int level : {0, 100}) {
            const Volume volume = sampled<std::int16_t>(g, [&](auto, auto, auto) { return level; });
            EXPECT_TRUE(extract_isosurface(volume, 50).triangles.empty());
            const Mesh capped = extract_isosurface(volume, 50, {.closed = true});
            EXPECT_EQ(capped.triangles.empty(), level == 0 || !has_samples);
            EXPECT_EQ(manifold_fault(capped), "");
            if (level == 100 && has_samples) {
                EXPECT_EQ(measure(capped).euler_characteristic, 2);
                // Each side of the box is half a sample outside the volume.
                EXPECT_EQ(measure(capped).lower, (Vec3f{-0.5f, -0.5f, -0.5f}));
            }
        }
    }
}

TEST(Isosurface, IsovaluesBeyondTheSampleTypeAreEmptyOrFull) {
    const Volume volume =
        sampled<std::int16_t>(grid(6, 6, 6), [](auto x, auto, auto) { return x % 2 ? 32767 : -32768; });
    EXPECT_TRUE(extract_isosurface(volume, 32767.5).triangles.empty());
    EXPECT_TRUE(extract_isosurface(volume, 1e300).triangles.empty());
    EXPECT_FALSE(extract_isosurface(volume, 32767).triangles.empty());
    EXPECT_TRUE(extract_isosurface(volume, -32768).triangles.empty());
    EXPECT_TRUE(extract_isosurface(volume, -1e300).triangles.empty());
    EXPECT_EQ(measure(extract_isosurface(volume, -1e300, {.closed = true})).components, 1);
}

// All isovalues between two integers separate the same samples. An isovalue that is an integer includes it.
TEST(Isosurface, IntegerSamplesAtTheIsovalueAreInside) {
    const Volume volume = sampled<std::uint8_t>(
        grid(5, 5, 5), [](auto x, auto y, auto z) { return x == 2 && y == 2 && z == 2 ? 10 : 0; });
    EXPECT_EQ(extract_isosurface(volume, 10).points.size(), 6u);
    EXPECT_EQ(extract_isosurface(volume, 10.0001).points.size(), 0u);
    EXPECT_EQ(extract_isosurface(volume, 9.9999).points.size(), 6u);
}

TEST(Isosurface, DoubleIsovalueIsNotRoundedForFloats) {
    const float above = std::nextafter(1.0f, 2.0f);
    const Volume volume =
        sampled<float>(grid(4, 4, 4), [&](auto x, auto, auto) { return x < 2 ? 1.0f : above; });
    const double between = (1.0 + static_cast<double>(above)) / 2;
    EXPECT_EQ(extract_isosurface(volume, between).points.size(), 16u);
    EXPECT_EQ(extract_isosurface(volume, 1.0).points.size(), 0u);
}

TEST(Isosurface, NonFiniteSamplesAreOutsideAndCounted) {
    Volume volume = sampled<float>(grid(70, 5, 5), [](auto, auto, auto) { return 10; });
    volume.samples<float>()[860] = std::numeric_limits<float>::quiet_NaN();
    volume.samples<float>()[861] = std::numeric_limits<float>::infinity();
    volume.samples<float>()[69] = -std::numeric_limits<float>::infinity();
    IsosurfaceStats stats;
    const Mesh mesh = extract_isosurface(volume, 1, {.closed = true}, &stats);
    EXPECT_EQ(stats.non_finite_samples, 3);
    EXPECT_EQ(manifold_fault(mesh), "");
    EXPECT_EQ(measure(mesh).components, 2);  // the box, and the hole around (20, 2, 2) and its neighbour
}

// The edge of the grid that a point lies on. Its samples are those at the lower and the higher coordinate, or
// -infinity if they are not finite or outside the volume.
struct Edge {
    std::size_t axis = 0;
    std::array<float, 2> samples{};
};

// Points never lie on samples, so rounding finds the ends of their edges. \pre a diagonal matrix, and
// spacings that are powers of two
Edge edge_of(const Volume& volume, const Vec3f& point) {
    const auto& [dims, spacing, origin, direction] = volume.geometry();
    Edge edge;
    std::array<std::int64_t, 3> ends[2];
    for (std::size_t a = 0; a < 3; ++a) {
        const double index = static_cast<double>(point[a]) / spacing[a];
        ends[0][a] = static_cast<std::int64_t>(std::floor(index));
        ends[1][a] = static_cast<std::int64_t>(std::ceil(index));
        if (ends[0][a] != ends[1][a]) edge.axis = a;
    }
    for (std::size_t e = 0; e < 2; ++e) {
        edge.samples[e] = -HUGE_VALF;
        bool within = true;
        for (std::size_t a = 0; a < 3; ++a) within &= ends[e][a] >= 0 && ends[e][a] < dims[a];
        if (!within) continue;
        const std::int64_t index = (ends[e][2] * dims[1] + ends[e][1]) * dims[0] + ends[e][0];
        visit_sample_type(volume.type(), [&](auto type) {
            const auto sample = volume.samples<decltype(type)>()[index];
            if (std::isfinite(static_cast<double>(sample))) edge.samples[e] = static_cast<float>(sample);
        });
    }
    return edge;
}

// How far a point's normal points along its edge from the inside end to the outside end.
float outward_along_edge(const Volume& volume, const Mesh& mesh, std::size_t p) {
    const Edge edge = edge_of(volume, mesh.points[p]);
    return edge.samples[0] > edge.samples[1] ? mesh.normals[p][edge.axis] : -mesh.normals[p][edge.axis];
}

TEST(Isosurface, NormalsNeverPointInwardsAlongTheirEdges) {
    Random random(53);
    for (int i = 0; i < 1000; ++i) {
        const RandomGrid g = random_grid(random);
        for (const bool closed : {false, true}) {
            const Mesh mesh = extract_isosurface(g.volume, g.isovalue, {.closed = closed});
            for (std::size_t p = 0; p < mesh.points.size(); ++p)
                ASSERT_GE(outward_along_edge(g.volume, mesh, p), 0) << "grid " << i << ", point " << p;
        }
    }
    Geometry geometry = grid(40, 30, 20);
    geometry.spacing = {0.5, 1, 4};
    const Volume noise = sampled<std::int16_t>(
        geometry, [&](auto, auto, auto) { return static_cast<int>(random() % 2001) - 1000; });
    const Mesh mesh = extract_isosurface(noise, 100.5);
    for (std::size_t p = 0; p < mesh.points.size(); ++p)
        ASSERT_GT(outward_along_edge(noise, mesh, p), 0) << p;
}

// Central differences across a wall of one sample have the sign of what lies before and behind it.
TEST(Isosurface, NormalsOfAThinWallFaceAwayFromIt) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const Volume volume = sampled<std::int16_t>(grid(9, 9, 9), [&](auto x, auto y, auto z) {
            const auto along = std::array{x, y, z}[axis];
            return along < 4 ? 40 : along == 4 ? 1000 : -1000;
        });
        const Mesh mesh = extract_isosurface(volume, 700);
        EXPECT_EQ(mesh.points.size(), 2 * 81u);
        for (std::size_t p = 0; p < mesh.points.size(); ++p)
            ASSERT_EQ(mesh.normals[p][axis], mesh.points[p][axis] < 4 ? -1 : 1) << axis << ' ' << p;
    }
}

// Noise is the worst case. Central differences alone turn one normal in twenty against its faces.
TEST(Isosurface, FewNormalsOfNoisePointAgainstTheirFaces) {
    Random random(54);
    const Volume noise = sampled<std::int16_t>(
        grid(30, 30, 30), [&](auto, auto, auto) { return static_cast<int>(random() % 2001) - 1000; });
    const Mesh mesh = extract_isosurface(noise, 100.5);
    std::vector<Vec3d> faces(mesh.points.size(), Vec3d{0, 0, 0});  // sums of unit normals
    for (const Triangle& triangle : mesh.triangles) {
        Vec3d u, v;
        for (std::size_t a = 0; a < 3; ++a) {
            const double first = static_cast<double>(mesh.points[triangle[0]][a]);
            u[a] = static_cast<double>(mesh.points[triangle[1]][a]) - first;
            v[a] = static_cast<double>(mesh.points[triangle[2]][a]) - first;
        }
        const Vec3d n{u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
        for (const std::uint32_t p : triangle)
            for (std::size_t a = 0; a < 3; ++a) faces[p][a] += n[a] / std::hypot(n[0], n[1], n[2]);
    }
    std::size_t against = 0;
    for (std::size_t p = 0; p < faces.size(); ++p) {
        double cosine = 0;
        for (std::size_t a = 0; a < 3; ++a) cosine += faces[p][a] * static_cast<double>(mesh.normals[p][a]);
        against += cosine < 0;
    }
    EXPECT_LT(static_cast<double>(against), 0.008 * static_cast<double>(faces.size()));
}

TEST(Isosurface, RefusesBadArguments) {
    const Volume volume = checkerboard(4);
    for (const double bad : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
        EXPECT_THROW(extract_isosurface(volume, bad), InputError);
        EXPECT_THROW(extract_isosurface_classic(volume, bad), InputError);
    }
    VolumeView view(volume);
    view.geometry.spacing[1] = 0;
    EXPECT_THROW(extract_isosurface(view, 0.5), InputError);
    view = VolumeView(volume);
    view.geometry.direction[2] = view.geometry.direction[1];
    EXPECT_THROW(extract_isosurface(view, 0.5), InputError);
    EXPECT_FALSE((std::is_constructible_v<VolumeView, Volume&&>)) << "a view of a temporary would dangle";
}

TEST(Isosurface, ProgressRisesToOneAndCancels) {
    const Volume volume = wobbly(80, 80, 80);
    double last = 0;
    extract_isosurface(volume, 0, {.progress = [&](double fraction) {
                           EXPECT_GE(fraction, last);
                           last = fraction;
                           return true;
                       }});
    EXPECT_EQ(last, 1);
    std::atomic<int> calls = 0;
    const auto cancel = [&](double) { return ++calls < 50; };
    EXPECT_THROW(extract_isosurface(volume, 0, {.progress = cancel}), Cancelled);
}

TEST(Isosurface, PlacesPointsThroughTheWholeMatrix) {
    Geometry g = grid(9, 9, 9);
    g.spacing = {0.5, 2, 3};
    g.origin = {-100, 50, 7};
    g.direction = {{{0, 0, 1}, {0.6, -0.8, 0}, {0.8, 0.6, 0}}};
    const Volume placed = sampled<float>(g, [](auto x, auto y, auto z) {
        return sphere({4, 4, 4}, 3)({static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)});
    });
    const Volume plain = sampled_in_space<float>(grid(9, 9, 9), sphere({4, 4, 4}, 3));
    const Mesh a = extract_isosurface(placed, 0), b = extract_isosurface(plain, 0);
    ASSERT_EQ(a.points.size(), b.points.size());
    for (std::size_t i = 0; i < a.points.size(); ++i) {
        const Vec3d truth = g.physical({b.points[i][0], b.points[i][1], b.points[i][2]});
        for (std::size_t r = 0; r < 3; ++r) EXPECT_NEAR(a.points[i][r], truth[r], 2e-5);
    }
}

TEST(Isosurface, MirroredDirectionStillFacesOutward) {
    Geometry g = grid(30, 30, 30);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        g.direction = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
        g.direction[axis][axis] = -1;
        const Vec3d centre = g.physical({15, 15, 15});
        const Volume volume = sampled_in_space<float>(g, sphere(centre, 10));
        const Mesh mesh = extract_isosurface(volume, 0);
        EXPECT_NEAR(measure(mesh).volume, 4188.8, 40);
        for (std::size_t i = 0; i < mesh.points.size(); ++i) {
            double outward = 0;
            for (std::size_t a = 0; a < 3; ++a)
                outward += (static_cast<double>(mesh.points[i][a]) - centre[a]) *
                           static_cast<double>(mesh.normals[i][a]);
            ASSERT_GT(outward, 9);
        }
    }
}

// A solid has the same points whatever the order of its samples in memory.
TEST(Isosurface, TransposeFlipAndNegateGiveTheSamePoints) {
    constexpr std::int64_t n = 24;
    const auto value = [](double x, double y, double z) {
        return std::sin(0.41 * x + 0.1) + std::sin(0.37 * y + 0.2) + std::sin(0.33 * z + 0.3);
    };
    const auto sorted_points = [](const Mesh& mesh, auto&& map) {
        std::vector<std::array<long, 3>> points;
        for (const Vec3f& p : mesh.points) {
            const Vec3f q = map(p);
            points.push_back({std::lround(q[0] * 2e4f), std::lround(q[1] * 2e4f), std::lround(q[2] * 2e4f)});
        }
        std::sort(points.begin(), points.end());
        return points;
    };
    const auto extract = [&](auto&& f) {
        const Volume volume = sampled<double>(grid(n, n, n), [&](auto x, auto y, auto z) {
            return f(static_cast<double>(x), static_cast<double>(y), static_cast<double>(z));
        });
        return extract_isosurface(volume, 0.05);
    };
    const auto same = [](const auto& a, const auto& b) {
        ASSERT_EQ(a.size(), b.size());
        for (std::size_t i = 0; i < a.size(); ++i) {
            for (std::size_t r = 0; r < 3; ++r) ASSERT_NEAR(a[i][r], b[i][r], 1) << "in 1/20000 of a sample";
        }
    };
    const auto plain = sorted_points(extract(value), [](const Vec3f& p) { return p; });
    same(plain, sorted_points(extract([&](double x, double y, double z) { return value(z, x, y); }),
                              [](const Vec3f& p) {
                                  return Vec3f{p[2], p[0], p[1]};
                              }));
    same(plain, sorted_points(extract([&](double x, double y, double z) { return value(n - 1 - x, y, z); }),
                              [](const Vec3f& p) {
                                  return Vec3f{n - 1 - p[0], p[1], p[2]};
                              }));
    same(plain, sorted_points(extract([&](double x, double y, double z) { return 0.1 - value(x, y, z); }),
                              [](const Vec3f& p) { return p; }));
}

}  // namespace
}  // namespace marrow::test
