// The surfaces of label maps, and the numbers of their samples.
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <set>

#include <gtest/gtest.h>

#include <marrow/labels.h>
#include <marrow/measure.h>

#include "core/surface_nets/label_meshes.h"
#include "support/fields.h"
#include "support/mesh_checks.h"

namespace marrow::test {
namespace {

template <class T>
Volume labelled(const Geometry& geometry, const std::vector<T>& labels) {
    Volume volume(geometry, sample_type_of<T>());
    std::copy(labels.begin(), labels.end(), volume.samples<T>());
    return volume;
}

template <class T>
Volume random_labels(const Geometry& geometry, unsigned seed, int labels) {
    std::mt19937 random(seed);
    std::uniform_int_distribution<int> label(0, labels);
    std::vector<T> samples(static_cast<std::size_t>(geometry.sample_count()));
    for (T& s : samples) s = static_cast<T>(label(random));
    return labelled(geometry, samples);
}

// Takes a Volume by reference, so that tests can pass a temporary one.
std::vector<LabelSurface> surfaces_of(const Volume& map, const LabelOptions& options = {}) {
    return extract_labels(map, options);
}

// Every surface is closed and manifold. Every triangle either is also one of another surface, facing the
// other way, or faces the background. The triangles that face the background are closed, too.
void expect_partition(const std::vector<LabelSurface>& surfaces) {
    std::multiset<std::array<PointBits, 3>> unmatched;
    for (const LabelSurface& s : surfaces) {
        ASSERT_EQ(manifold_fault(s.mesh), "") << "label " << s.label;
        for (const auto& t : triangle_positions(s.mesh)) unmatched.insert(t);
    }
    for (const LabelSurface& s : surfaces) {
        Mesh flipped = s.mesh;
        for (Triangle& t : flipped.triangles) std::swap(t[1], t[2]);
        for (const auto& t : triangle_positions(flipped)) {
            const auto match = unmatched.find(t);
            if (match != unmatched.end()) unmatched.erase(match);
        }
    }
    std::map<std::pair<PointBits, PointBits>, int> edges;
    for (const auto& t : unmatched) {
        for (std::size_t c = 0; c < 3; ++c) {
            const auto &a = t[c], &b = t[(c + 1) % 3];
            edges[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
        }
    }
    for (const auto& [edge, sum] : edges) ASSERT_EQ(sum, 0);
}

TEST(Labels, SurfacesOfRandomMapsAreClosedAndMeet) {
    for (unsigned seed = 0; seed < 400; ++seed) {
        SCOPED_TRACE(seed);
        const int labels = 1 + static_cast<int>(seed % 6);
        const auto n = [&](unsigned bits) { return std::int64_t{1 + seed / bits % 5}; };
        const Volume map = random_labels<std::uint8_t>(grid(n(1), n(3), n(7)), seed, labels);
        for (const int relax : {0, 10}) expect_partition(surfaces_of(map, {.relax = relax}));
        if (HasFatalFailure()) return;
    }
}

// Points and triangles are counted in slabs of eight slices of cells.
TEST(Labels, SurfacesOfDeepRandomMapsAreClosedAndMeet) {
    for (unsigned seed = 0; seed < 24; ++seed) {
        SCOPED_TRACE(seed);
        const Volume map =
            random_labels<std::int16_t>(grid(4, 5, 7 + seed), seed, 1 + static_cast<int>(seed % 4));
        for (const int relax : {0, 10}) expect_partition(surfaces_of(map, {.relax = relax}));
        if (HasFatalFailure()) return;
    }
}

TEST(Labels, PositionsOfDifferentPointsDiffer) {
    int shared = 0, points = 0;
    for (unsigned seed = 0; seed < 60; ++seed) {
        for (const LabelSurface& s :
             surfaces_of(random_labels<std::uint8_t>(grid(5, 5, 5), seed, 1 + seed % 3))) {
            std::set<PointBits> positions;
            for (const Vec3f& p : s.mesh.points) positions.insert(bits_of(p));
            shared += static_cast<int>(s.mesh.points.size() - positions.size());
            points += static_cast<int>(s.mesh.points.size());
            if (seed % 3 == 0) {  // one label and background
                EXPECT_EQ(positions.size(), s.mesh.points.size());
            }
        }
    }
    EXPECT_LT(shared, points / 20);  // only where other labels meet parts of a label
}

TEST(Labels, FindsEveryLabelOfEveryType) {
    Geometry g = grid(70, 3, 4);
    std::vector<int> samples(static_cast<std::size_t>(g.sample_count()), 0);
    samples[0] = 7;
    samples[69] = 100;
    samples[70 * 5 + 64] = 5;
    samples.back() = 120;
    const auto check = [&]<class T>(T) {
        const std::vector<T> typed(samples.begin(), samples.end());
        const auto surfaces = surfaces_of(labelled(g, typed));
        ASSERT_EQ(surfaces.size(), 4u);
        const std::int64_t expected[] = {5, 7, 100, 120};
        for (std::size_t i = 0; i < 4; ++i) {
            EXPECT_EQ(surfaces[i].label, expected[i]);
            EXPECT_EQ(measure(surfaces[i].mesh).euler_characteristic, 2);
        }
    };
    check(std::uint8_t{});
    check(std::int8_t{});
    check(std::uint16_t{});
    check(std::int16_t{});
    check(std::int32_t{});
    check(float{});
    check(double{});
}

TEST(Labels, NegativeLabelsAndAnotherBackground) {
    const Volume map = labelled<std::int16_t>(grid(4, 1, 1), {-3, 0, 9, 9});
    const auto surfaces = surfaces_of(map, {.background = 9});
    ASSERT_EQ(surfaces.size(), 2u);
    EXPECT_EQ(surfaces[0].label, -3);
    EXPECT_EQ(surfaces[1].label, 0);
    EXPECT_THROW(surfaces_of(labelled<std::uint8_t>(grid(1, 1, 1), {1}), {.background = 256}), InputError);
    for (const std::int64_t background :
         {std::numeric_limits<std::int64_t>::max(), std::numeric_limits<std::int64_t>::min()}) {
        EXPECT_THROW(surfaces_of(labelled<float>(grid(1, 1, 1), {1}), {.background = background}),
                     InputError);
        EXPECT_THROW(surfaces_of(labelled<double>(grid(1, 1, 1), {1}), {.background = background}),
                     InputError);
    }
}

TEST(Labels, AreAtMost65535BesidesTheBackground) {
    std::vector<std::int32_t> samples(65536);
    std::iota(samples.begin(), samples.end(), 0);
    samples[0] = 1;
    const Volume map = labelled(grid(256, 256, 1), samples);
    EXPECT_EQ(surfaces_of(map, {.relax = 0, .normals = false}).size(), 65535u);
    samples[0] = 65536;
    EXPECT_THROW(surfaces_of(labelled(grid(256, 256, 1), samples), {.relax = 0}), InputError);
}

TEST(Labels, FacesOutward) {
    for (const double sign : {1.0, -1.0}) {
        Geometry g = grid(12, 12, 12);
        g.spacing = {0.5, 1, 2};
        for (auto& row : g.direction) row[0] *= sign;  // mirrored or not
        std::vector<std::uint8_t> samples;
        for (int i = 0; i < 12 * 12 * 12; ++i) {
            const double x = i % 12 - 5.5, y = i / 12 % 12 - 5.5, z = i / 144 - 5.5;
            const double r = std::sqrt(x * x + y * y + z * z);
            samples.push_back(r < 2.5 ? 2 : r < 5 ? 1 : 0);
        }
        const auto surfaces = surfaces_of(labelled(g, samples));
        const MeshMeasures shell = measure(surfaces[0].mesh), core = measure(surfaces[1].mesh);
        EXPECT_EQ(shell.components, 2);
        EXPECT_GT(core.volume, 0);
        EXPECT_GT(shell.volume, core.volume);
        EXPECT_NEAR(shell.volume + core.volume, 4 / 3.0 * M_PI * 125, 40);
        const Mesh& mesh = surfaces[1].mesh;
        const Vec3d middle = g.physical({5.5, 5.5, 5.5});
        for (std::size_t p = 0; p < mesh.points.size(); ++p) {
            double out = 0, length = 0;
            for (std::size_t a = 0; a < 3; ++a) {
                out += mesh.normals[p][a] * (mesh.points[p][a] - middle[a]);
                length += mesh.normals[p][a] * mesh.normals[p][a];
            }
            EXPECT_GT(out, 0);
            EXPECT_NEAR(length, 1, 1e-5);
        }
    }
}

TEST(Labels, NormalsAreUnitVectorsInAnyUnitOfLength) {
    for (const double spacing : {1e-30, 1e-25, 1e-12, 1.0, 1e10, 1e20, 1e30}) {
        Geometry g = grid(3, 3, 3);
        g.spacing = {spacing, spacing, spacing};
        std::vector<std::uint8_t> samples(27);
        samples[13] = 1;
        const std::vector<LabelSurface> surfaces = surfaces_of(labelled(g, samples));
        for (const Vec3f& n : surfaces.at(0).mesh.normals) {
            EXPECT_NEAR(length(to_double(n)), 1, 1e-6);
            EXPECT_LT(std::abs(n[2]), 0.99f);
        }
    }
}

// Normals of an unsmoothed surface jump between the axes.
TEST(Labels, RelaxationSmoothsStairsAndKeepsVolume) {
    const Geometry g = grid(60, 60, 60);
    std::vector<std::uint8_t> samples;
    for (int i = 0; i < 60 * 60 * 60; ++i) {
        const double x = i % 60 - 29.5, y = i / 60 % 60 - 29.5, z = i / 3600 - 29.5;
        samples.push_back(std::sqrt(x * x + y * y + z * z) < 22 ? 1 : 0);
    }
    const Volume map = labelled(g, samples);
    const auto mean_tilt = [](const Mesh& mesh) {
        double sum = 0;
        for (std::size_t p = 0; p < mesh.points.size(); ++p) {
            double dot = 0, length = 0;
            for (std::size_t a = 0; a < 3; ++a) {
                const double from_middle = mesh.points[p][a] - 29.5;
                dot += mesh.normals[p][a] * from_middle;
                length += from_middle * from_middle;
            }
            sum += std::acos(std::min(1.0, dot / std::sqrt(length))) * 180 / M_PI;
        }
        return sum / static_cast<double>(mesh.points.size());
    };
    const auto raw = surfaces_of(map, {.relax = 0}), relaxed = surfaces_of(map);
    const double ball = 4 / 3.0 * M_PI * 22 * 22 * 22;
    EXPECT_LT(mean_tilt(relaxed[0].mesh), mean_tilt(raw[0].mesh) / 2);
    EXPECT_LT(mean_tilt(relaxed[0].mesh), 4);
    EXPECT_NEAR(measure(relaxed[0].mesh).volume, ball, 0.01 * ball);
    EXPECT_LT(measure(relaxed[0].mesh).area, 1.02 * 4 * M_PI * 22 * 22);
}

TEST(Labels, PointsStayInTheirCells) {
    const Volume map = random_labels<std::uint8_t>(grid(6, 7, 8), 4, 3);
    const auto raw = surfaces_of(map, {.relax = 0}), relaxed = surfaces_of(map, {.relax = 50});
    for (std::size_t i = 0; i < raw.size(); ++i) {
        ASSERT_EQ(raw[i].mesh.points.size(), relaxed[i].mesh.points.size());
        for (std::size_t p = 0; p < raw[i].mesh.points.size(); ++p) {
            for (std::size_t a = 0; a < 3; ++a) {
                const float middle = std::floor(raw[i].mesh.points[p][a]) + 0.5f;
                ASSERT_LE(std::abs(relaxed[i].mesh.points[p][a] - middle), 0.5f);
            }
        }
    }
}

// Threads relax bands of slices: one or several bands, thick and thin ones, and more passes than run
// together.
TEST(Labels, TheSameForAnyNumberOfThreads) {
    for (const std::int64_t slices : {1, 15, 20, 67}) {
        const Volume map = random_labels<std::uint16_t>(grid(30, 20, slices), 2, 9);
        for (const int relax : {0, 3, 4, 13}) {
            const auto one = surfaces_of(map, {.relax = relax, .threads = 1});
            for (const int threads : {2, 3, 7}) {
                const auto some = surfaces_of(map, {.relax = relax, .threads = threads});
                ASSERT_EQ(one.size(), some.size());
                for (std::size_t i = 0; i < one.size(); ++i)
                    EXPECT_EQ(mesh_hash(one[i].mesh), mesh_hash(some[i].mesh))
                        << slices << " slices, relax " << relax << ", threads " << threads;
            }
        }
    }
}

TEST(Labels, RefusesSamplesThatAreNotLabels) {
    EXPECT_THROW(surfaces_of(labelled<float>(grid(2, 1, 1), {1, 1.5})), InputError);
    EXPECT_THROW(surfaces_of(labelled<double>(grid(2, 1, 1), {1, std::nan("")})), InputError);
    std::vector<std::int32_t> many(70000);
    for (std::size_t i = 0; i < many.size(); ++i) many[i] = static_cast<std::int32_t>(i);
    EXPECT_THROW(surfaces_of(labelled(grid(700, 100, 1), many)), InputError);
}

TEST(Labels, RefusesVolumesWithoutSamples) {
    VolumeView map;
    map.geometry = grid(2, 2, 2);
    EXPECT_THROW(extract_labels(map), InputError);
    EXPECT_THROW(count_labels(map), InputError);
}

TEST(Labels, EmptyVolumesHaveNoLabels) {
    EXPECT_TRUE(extract_labels(VolumeView()).empty());
    EXPECT_TRUE(count_labels(VolumeView()).empty());
}

TEST(Labels, BackgroundHasNoSurface) {
    EXPECT_TRUE(surfaces_of(labelled<std::uint8_t>(grid(2, 2, 1), {0, 0, 0, 0})).empty());
}

TEST(Labels, ReportsProgressAndCanBeCancelled) {
    const Volume map = random_labels<std::uint8_t>(grid(9, 9, 9), 1, 3);
    EXPECT_THROW(surfaces_of(map, {.progress = [](double f) { return f < 0.5; }}), Cancelled);
    double last = 0;
    surfaces_of(map, {.progress = [&](double fraction) {
                    EXPECT_GE(fraction, last);
                    last = fraction;
                    return true;
                }});
    EXPECT_EQ(last, 1);
}

TEST(Labels, CanBeCancelledAtAnyTime) {
    const Volume map = random_labels<float>(grid(9, 9, 9), 1, 3);
    const auto calls_until = [&](int most) {
        int calls = 0;
        try {
            surfaces_of(map, {.relax = 12, .threads = 1, .progress = [&](double) { return ++calls < most; }});
        } catch (const Cancelled&) {
            EXPECT_EQ(calls, most);
            return calls;
        }
        EXPECT_LT(calls, most);
        return calls;
    };
    const int all = calls_until(std::numeric_limits<int>::max());
    EXPECT_GT(all, 9 + 3 * 9 + 12 * 10) << "checks and borders by slices, relaxation by slices and passes";
    for (int most = 1; most < all; most += 3) EXPECT_EQ(calls_until(most), most);
}

// Memory that was used before has other values than 0.
TEST(Labels, PointsOfTheNetThatNoSurfaceHasAreAtZero) {
    constexpr std::size_t kPoints = 100;
    { const Buffer<Vec3f> used(kPoints, Vec3f{7, 7, 7}); }
    const internal::LabelMeshes meshes{std::vector<Mesh>(1), std::vector<Buffer<std::uint32_t>>(1)};
    for (const Vec3f& p : internal::net_positions(meshes, kPoints)) EXPECT_EQ(p, Vec3f{});
}

TEST(Labels, AreCounted) {
    const Volume map = random_labels<std::int16_t>(grid(13, 7, 9), 3, 4);
    std::map<std::int64_t, std::int64_t> expected;
    for (std::int64_t i = 0; i < map.geometry().sample_count(); ++i)
        ++expected[map.samples<std::int16_t>()[i]];
    EXPECT_EQ(count_labels(map), expected);
    EXPECT_EQ(count_labels(map, {.threads = 1}), expected);
    double last = 0;
    count_labels(map, {.progress = [&](double fraction) {
                     EXPECT_GT(fraction, last);
                     last = fraction;
                     return true;
                 }});
    EXPECT_NEAR(last, 1, 1e-9);
    EXPECT_THROW(count_labels(map, {.progress = [](double) { return false; }}), Cancelled);
    Volume not_labels = random_labels<float>(grid(3, 3, 3), 3, 4);
    not_labels.samples<float>()[5] = std::numeric_limits<float>::quiet_NaN();
    EXPECT_THROW(count_labels(not_labels), InputError);
}

}  // namespace
}  // namespace marrow::test
