// Goes from a scan to a printable surface through every combination of the steps.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <map>
#include <ostream>
#include <random>
#include <string>

#include <marrow/components.h>
#include <marrow/isosurface.h>
#include <marrow/labels.h>
#include <marrow/measure.h>
#include <marrow/mesh_check.h>
#include <marrow/scan_io.h>
#include <marrow/simplify.h>
#include <marrow/smooth.h>
#include <marrow/volume_filters.h>

#include "cranium.h"
#include "support/fields.h"
#include "support/mesh_checks.h"

namespace marrow::test {
namespace {

constexpr double kBone = 226, kSkin = -300;

Mesh closed_surface(const Volume& volume, double isovalue) {
    return extract_isosurface(volume, isovalue, {.closed = true});
}

std::string fault(const Mesh& mesh) {
    const std::string found = manifold_fault(mesh);
    if (!found.empty()) return found;
    const MeshCheck check = check_mesh(mesh);
    if (check.self_intersections > 0) return "passes through itself";
    return check.is_oriented() ? "" : "faces inward";
}

// Whether to run the tests that take minutes each.
bool wants_long_tests() {
    const char* wanted = std::getenv("MARROW_TEST_LONG");
    return wanted != nullptr && *wanted != '\0';
}
constexpr const char* kLong = "this test takes some minutes: set MARROW_TEST_LONG to run it";

// Smooths with and without bounds, and reduces by share and by error. Every result must be valid, and have
// the topology of the surface. Does all combinations, or by default a random choice of them.
void walk_steps(const Mesh& surface, const Mat3d& cell, Random& random) {
    if (surface.triangles.empty()) return;
    const MeshCheck before = check_mesh(surface);
    ASSERT_EQ(before.self_intersections, 0);
    const auto expect_valid = [&](const Mesh& mesh) {
        const MeshCheck after = check_mesh(mesh);
        EXPECT_EQ(manifold_fault(mesh), "");
        EXPECT_EQ(after.self_intersections, 0);
        EXPECT_EQ(after.genus, before.genus);
        EXPECT_EQ(after.measures.components, before.measures.components);
    };
    const auto is_chosen = [&](unsigned one_of) { return wants_long_tests() || random() % one_of == 0; };
    for (const int iterations : {0, 5, 20, 60}) {
        for (const int bound : {0, 1, 2}) {
            if (!is_chosen(6)) continue;
            SCOPED_TRACE(testing::Message() << "smooth " << iterations << ", bound " << bound);
            SmoothOptions options{.iterations = iterations};
            if (bound == 1) options.bound = cell;
            if (bound == 2) options.max_move = 0.2;
            const Mesh smoothed = smooth(surface, options);
            expect_valid(smoothed);
            const auto all = static_cast<double>(smoothed.triangles.size());
            for (const double keep : {0.5, 0.1, 0.02})
                expect_valid(simplify(smoothed, {.triangles = std::llround(keep * all)}));
            for (const double error : {0.05, 0.2}) {
                if (!is_chosen(8)) continue;
                const Mesh near = simplify(smoothed, {.max_error = error});
                expect_valid(near);
                EXPECT_LE(mesh_distance(smoothed, near).max, error);
            }
        }
    }
}

// Combines filters, snapping, components, smoothing and reduction, each in several ways or not at all. Every
// result must be closed, manifold and oriented.
void walk_combinations(const Volume& scan, double isovalue) {
    const std::vector<ComponentOptions> choices{{}, {.count = 2}, {.min_volume = 20, .cavities = false}};
    const Mat3d cell = scan.geometry().index_to_physical();
    for (const bool filtered : {false, true}) {
        const Volume median = filtered ? median_filter(scan, 1) : Volume();
        for (const double snap : {0.0, 0.3}) {
            const Mesh surface =
                extract_isosurface(filtered ? median : scan, isovalue, {.closed = true, .snap = snap});
            ASSERT_GT(surface.triangles.size(), 2'000u);
            for (std::size_t choice = 0; choice < choices.size(); ++choice) {
                const Mesh chosen = keep_components(surface, choices[choice]);
                for (const int smoothing : {0, 1, 2}) {
                    SmoothOptions options{.iterations = smoothing == 0 ? 0 : 20};
                    if (smoothing == 2) options.bound = cell;
                    const Mesh smoothed = smooth(chosen, options);
                    SCOPED_TRACE(testing::Message()
                                 << "isovalue " << isovalue << ", median " << filtered << ", snap " << snap
                                 << ", components " << choice << ", smoothing " << smoothing);
                    ASSERT_EQ(fault(smoothed), "");
                    const auto all = static_cast<double>(smoothed.triangles.size());
                    for (const double keep : {0.3, 0.05}) {
                        const Mesh reduced = simplify(smoothed, {.triangles = std::llround(keep * all)});
                        ASSERT_EQ(fault(reduced), "");
                        ASSERT_LT(static_cast<double>(reduced.triangles.size()), 2 * keep * all);
                    }
                    if (choice != 1 || snap > 0) continue;  // the next step takes several times as long
                    const Mesh near = simplify(smoothed, {.max_error = 0.3});
                    ASSERT_EQ(fault(near), "");
                    ASSERT_LE(mesh_distance(smoothed, near).max, 0.3);
                }
            }
        }
    }
}

// Applies each step once to a complete scan.
void walk_once(const Volume& scan, double isovalue) {
    const Volume calm = median_filter(scan, 1);
    const Mesh surface = extract_isosurface(calm, isovalue, {.closed = true, .snap = 0.3});
    const Mesh chosen = keep_components(surface, {.min_volume = 20, .cavities = false});
    SmoothStats smoothing;
    const Mesh smoothed = smooth(chosen, {.bound = scan.geometry().index_to_physical()}, &smoothing);
    ASSERT_EQ(fault(smoothed), "");
    EXPECT_NEAR(measure(smoothed).volume / measure(chosen).volume, 1, 0.01);
    const auto wanted = static_cast<std::int64_t>(smoothed.triangles.size() / 10);
    SimplifyStats reduction;
    const Mesh reduced = simplify(smoothed, {.triangles = wanted}, &reduction);
    EXPECT_EQ(fault(reduced), "");
    EXPECT_LE(static_cast<std::int64_t>(reduced.triangles.size()), wanted);
    EXPECT_EQ(measure(reduced).components, measure(smoothed).components);
    // The reported deviation is the measured one.
    const MeshDistance apart = mesh_distance(smoothed, reduced);
    EXPECT_EQ(reduction.deviation.mean, apart.mean);
    EXPECT_EQ(reduction.deviation.max, apart.max);
}

Volume crop_around(const Volume& scan, std::array<std::int64_t, 3> middle, std::int64_t half) {
    std::array<std::int64_t, 3> last = middle;
    for (std::size_t a = 0; a < 3; ++a) {
        middle[a] = std::max<std::int64_t>(middle[a] - half, 0);
        last[a] = std::min(last[a] + half, scan.geometry().dims[a] - 1);
    }
    return crop(scan, middle, last);
}

// The path of a file or folder of the scans for tests; empty if it is not there.
std::filesystem::path test_data(const std::filesystem::path& path) {
    const char* data = std::getenv("MARROW_TEST_DATA");
    const std::filesystem::path found = std::filesystem::path(data ? data : "") / path;
    return data && std::filesystem::exists(found) ? found : std::filesystem::path();
}

class Cranium : public testing::Test {
  protected:
    void SetUp() override {
        std::optional<Volume> found = bench::cranium();
        if (!found) GTEST_SKIP() << "the package invesalius-examples is not installed";
        scan = std::move(*found);
    }
    Volume scan;
};

TEST_F(Cranium, StaysClosedAndManifoldThroughEveryCombination) {
    const Volume face = crop_around(scan, {128, 50, 54}, 40);
    for (const double isovalue : {kBone, kSkin}) walk_combinations(face, isovalue);
}

TEST_F(Cranium, StaysClosedAndManifoldThroughEveryCombinationOfTheCompleteScan) {
    if (!wants_long_tests()) GTEST_SKIP() << kLong;
    for (const double isovalue : {kBone, kSkin}) walk_combinations(scan, isovalue);
}

TEST_F(Cranium, StaysClosedAndManifoldAsACompleteScan) {
    for (const double isovalue : {kBone, kSkin}) walk_once(scan, isovalue);
}

TEST_F(Cranium, KeepsItsVolumeWhenSmoothed) {
    for (const double isovalue : {kBone, kSkin}) {
        const Mesh mesh = closed_surface(scan, isovalue);
        const Mesh smoothed = smooth(mesh);
        EXPECT_NEAR(measure(smoothed).volume / measure(mesh).volume, 1, 0.01);
        EXPECT_LT(measure(smoothed).area, measure(mesh).area);
        EXPECT_EQ(fault(smoothed), "");
    }
}

TEST_F(Cranium, KeepsATenthOfAMillimetre) {
    const Volume temple = crop_around(scan, {80, 100, 40}, 20);
    for (const double isovalue : {kBone, kSkin}) {
        const Mesh mesh = smooth(closed_surface(temple, isovalue));
        SimplifyStats stats;
        const Mesh reduced = simplify(mesh, {.max_error = 0.1}, &stats);
        EXPECT_LE(mesh_distance(mesh, reduced).max, 0.1);
        EXPECT_LT(reduced.triangles.size(), mesh.triangles.size() / 2);
        EXPECT_EQ(fault(reduced), "");
    }
}

TEST_F(Cranium, IsLessNoisyAfterTheFiltersAndKeepsItsVolume) {
    const Volume back = crop_around(scan, {128, 200, 50}, 30);
    const Volume calm = median_filter(back, 1), blurred = gaussian_filter(calm, 0.7);
    const Volume even = resample_isotropic(blurred, back.geometry().spacing[0]);
    const Mesh raw = closed_surface(back, kBone), mesh = closed_surface(blurred, kBone);
    EXPECT_LT(measure(mesh).components, measure(raw).components);
    EXPECT_LT(roughness(mesh, 2).roughness, 0.8 * roughness(raw, 2).roughness);
    EXPECT_NEAR(measure(mesh).volume / measure(raw).volume, 1, 0.1);
    EXPECT_NEAR(measure(closed_surface(even, kBone)).volume / measure(mesh).volume, 1, 0.02);
}

class VisibleHuman : public testing::Test {
  protected:
    void SetUp() override {
        const std::filesystem::path head = test_data("vhf_head_ct");
        if (head.empty()) GTEST_SKIP() << "vhf_head_ct is missing";
        scan = read_scan(head);
    }
    Volume scan;
};

TEST_F(VisibleHuman, StaysClosedAndManifoldThroughEveryCombination) {
    const Volume face = crop_around(scan, {256, 142, 117}, 40);
    for (const double isovalue : {kBone, kSkin}) walk_combinations(face, isovalue);
}

TEST_F(VisibleHuman, StaysClosedAndManifoldThroughEveryCombinationOfTheCompleteScan) {
    if (!wants_long_tests()) GTEST_SKIP() << kLong;
    for (const double isovalue : {kBone, kSkin}) walk_combinations(scan, isovalue);
}

TEST_F(VisibleHuman, StaysClosedAndManifoldAsACompleteScan) {
    for (const double isovalue : {kBone, kSkin}) walk_once(scan, isovalue);
}

// Walls of one or two samples between two regions of noise.
Volume thin_walls(Random& random) {
    const double slope = std::uniform_real_distribution<double>(-0.5, 0.5)(random);
    std::normal_distribution<double> noise(0, 0.4);
    return sampled<float>(grid(12, 12, 12), [&](auto x, auto y, auto z) {
        const double phase = static_cast<double>(x) + slope * static_cast<double>(y + z);
        return (std::fmod(phase + 20, 4) < 1.6 ? 1.0 : -1.0) + noise(random);
    });
}

TEST(Noise, StaysValidThroughEveryCombination) {
    Random random(3);
    for (int trial = 0; trial < (wants_long_tests() ? 200 : 50); ++trial) {
        SCOPED_TRACE(trial);
        const RandomGrid one = trial % 2 == 0 ? random_grid(random) : RandomGrid{thin_walls(random), 0};
        for (const double snap : {0.0, 0.3}) {
            const Mesh surface = extract_isosurface(one.volume, one.isovalue, {.closed = true, .snap = snap});
            if (surface.triangles.empty()) continue;
            walk_steps(surface, one.volume.geometry().index_to_physical(), random);
        }
    }
}

TEST_F(Cranium, StaysValidThroughEveryCombination) {
    Random random(1);
    const Volume part = wants_long_tests() ? std::move(scan) : crop_around(scan, {128, 50, 54}, 14);
    for (const double isovalue : {kBone, kSkin}) {
        for (const double snap : {0.0, 0.3})
            walk_steps(extract_isosurface(part, isovalue, {.closed = true, .snap = snap}),
                       part.geometry().index_to_physical(), random);
    }
}

TEST_F(VisibleHuman, StaysValidThroughEveryCombination) {
    Random random(1);
    const Volume part = wants_long_tests() ? std::move(scan) : crop_around(scan, {256, 142, 117}, 14);
    for (const double isovalue : {kBone, kSkin}) {
        for (const double snap : {0.0, 0.3})
            walk_steps(extract_isosurface(part, isovalue, {.closed = true, .snap = snap}),
                       part.geometry().index_to_physical(), random);
    }
}

// Lumps of labels, whose relaxed surfaces come close to each other: each sample has the label of
// about the nearest of some points.
Volume lumps(Random& random) {
    constexpr int kSize = 16, kLabels = 6, kPoints = 18;
    std::uniform_real_distribution<double> anywhere(0, kSize), noise(0, 6);
    std::vector<Vec3d> points;
    for (int i = 0; i < kPoints; ++i)
        points.push_back({anywhere(random), anywhere(random), anywhere(random)});
    return sampled<std::uint8_t>(grid(kSize, kSize, kSize), [&](auto x, auto y, auto z) {
        const Vec3d here{static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)};
        std::size_t nearest = 0;
        double least = std::numeric_limits<double>::infinity();
        for (std::size_t i = 0; i < points.size(); ++i) {
            const double distance = dot(points[i] - here, points[i] - here) + noise(random);
            if (distance < least) least = distance, nearest = i;
        }
        return static_cast<int>(nearest % kLabels);
    });
}

// Expects that the surfaces of labels pass neither through themselves nor through each other.
// Returns how many points were held back.
std::int64_t expect_valid_labels(const Volume& map, int relax) {
    const std::vector<LabelSurface> surfaces = extract_labels(map, {.relax = relax});
    std::vector<MeshView> meshes;
    std::int64_t held_back = 0;
    for (const LabelSurface& surface : surfaces) {
        held_back += surface.held_back_points;
        EXPECT_EQ(check_mesh(surface.mesh).self_intersections, 0) << "label " << surface.label;
        meshes.push_back(surface.mesh);
    }
    EXPECT_TRUE(find_crossings(meshes).empty());
    return held_back;
}

TEST(Labels, StayValidWhenRelaxed) {
    std::map<int, std::int64_t> held_back;
    // After one pass or three, many points are at equal heights, and quads can
    // be folded onto their neighbours.
    for (unsigned seed = 0; seed < 60; ++seed) {
        Random random(seed);
        const Volume map =
            seed % 2 == 0 ? lumps(random) : sampled<std::uint8_t>(grid(7, 7, 7), [&](auto, auto, auto) {
                return static_cast<int>(random() % (2 + seed % 3));
            });
        for (const int relax : {0, 1, 3, 40}) {
            SCOPED_TRACE(testing::Message() << "seed " << seed << ", relax " << relax);
            held_back[relax] += expect_valid_labels(map, relax);
        }
    }
    EXPECT_EQ(held_back[0], 0);
    EXPECT_GT(held_back[1], 0);
    EXPECT_GT(held_back[3], 0);
}

struct LabelMap {
    const char *name, *path;
};

void PrintTo(const LabelMap& map, std::ostream* out) {
    *out << map.path;
}

class LabelMaps : public testing::TestWithParam<LabelMap> {};

TEST_P(LabelMaps, StayValidWhenRelaxed) {
    if (!wants_long_tests()) GTEST_SKIP() << kLong;
    const std::filesystem::path path = test_data(GetParam().path);
    if (path.empty()) GTEST_SKIP() << GetParam().path << " is missing";
    expect_valid_labels(read_scan(path), 40);
}

INSTANTIATE_TEST_SUITE_P(
    All, LabelMaps,
    testing::Values(LabelMap{"Brain", "/usr/share/mricron/templates/aal.nii.gz"},
                    LabelMap{"Frog", "frog_labels/frog_labels/frogtissue.mhd"},
                    LabelMap{"Jaws", "dental_labels/dental_labels/PostDentalSurgery_Segmentation.nii.gz"}),
    [](const auto& info) { return std::string(info.param.name); });

struct ScanCase {
    const char *name, *path;
    double dense, skin;  // isovalues
    ScanOptions options = {};
};

void PrintTo(const ScanCase& scan, std::ostream* out) {
    *out << scan.path;
}

class OtherScans : public testing::TestWithParam<ScanCase> {};

TEST_P(OtherScans, StayValidThroughEveryCombination) {
    if (!wants_long_tests()) GTEST_SKIP() << kLong;
    const std::filesystem::path path = test_data(GetParam().path);
    if (path.empty()) GTEST_SKIP() << GetParam().path << " is missing";
    const Volume scan = read_scan(path, GetParam().options);
    Random random(1);
    for (const double isovalue : {GetParam().dense, GetParam().skin}) {
        for (const double snap : {0.0, 0.3})
            walk_steps(extract_isosurface(scan, isovalue, {.closed = true, .snap = snap}),
                       scan.geometry().index_to_physical(), random);
    }
}

INSTANTIATE_TEST_SUITE_P(
    All, OtherScans,
    testing::Values(ScanCase{"SmallHead", "slicer_cthead_dcm", 1150, 500},
                    ScanCase{"Tooth", "tooth_sci/tooth_sci/tooth.nhdr", 600, 300},
                    ScanCase{"Abdomen", "totalseg/totalseg/example_ct.nii.gz", kBone, kSkin},
                    ScanCase{"Ankle", "vhf_ankle_ct", kBone, kSkin},
                    ScanCase{"TiltedHead", "qa_ct_ge_tilt", kBone, kSkin, {.resample = true}},
                    ScanCase{"KneeMr", "knee_t2_2echo_bigendian", 2000, 500, {.volume = 0}}),
    [](const auto& info) { return std::string(info.param.name); });

TEST(Noise, StaysClosedThroughAllSteps) {
    Random random(41);
    for (int trial = 0; trial < 60; ++trial) {
        SCOPED_TRACE(trial);
        const RandomGrid one = random_grid(random);
        const auto pick = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
        Volume volume = crop(one.volume, {0, 0, 0}, [&] {
            std::array<std::int64_t, 3> last = one.volume.geometry().dims;
            for (std::int64_t& i : last) i -= 1 + pick(2);
            return last;
        }());
        if (pick(2)) volume = median_filter(volume, 1 + pick(2));
        if (pick(2)) volume = gaussian_filter(volume, 0.3 + pick(2));
        if (pick(2)) volume = resample_isotropic(volume, pick(2) ? 0.4 : 1.3);
        Mesh mesh = closed_surface(volume, one.isovalue);
        const auto expect_closed = [&](const char* after) {
            if (!mesh.triangles.empty()) {
                ASSERT_EQ(manifold_fault(mesh), "") << after;
            }
        };
        expect_closed("extraction");
        ComponentOptions components{.min_volume = 0.1 * pick(3), .cavities = pick(2) == 0};
        if (const int count = pick(4); count > 0) components.count = count;
        mesh = keep_components(mesh, components);
        expect_closed("components");
        SmoothOptions options{.iterations = pick(40)};
        if (pick(2)) options.bound = volume.geometry().index_to_physical();
        mesh = smooth(mesh, options);
        expect_closed("smooth");
        if (mesh.triangles.empty()) continue;
        if (trial % 4 == 0)
            mesh =
                pick(2) ? simplify(mesh, {.triangles = 1 + pick(200)}) : simplify(mesh, {.max_error = 0.2});
        expect_closed("simplify");
        const MeshCheck check = check_mesh(mesh, {.min_wall = 0.3});
        EXPECT_TRUE(check.is_closed() && check.is_manifold() && check.misoriented_edges == 0);
    }
}

}  // namespace
}  // namespace marrow::test
