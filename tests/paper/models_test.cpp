// What the paper's six models, cut out of real scans, must show: sharing and snapping, each by itself.
#include <gtest/gtest.h>

#include <cstdlib>

#include <marrow/isosurface.h>
#include <marrow/measure.h>
#include <marrow/scan_io.h>

#include "cranium.h"
#include "models.h"
#include "support/mesh_checks.h"

namespace marrow::test {
namespace {

std::vector<paper::Model> models() {
    const char* data = std::getenv("MARROW_TEST_DATA");
    const std::filesystem::path folder = data != nullptr ? data : "";
    if (!std::filesystem::exists(folder / "vhf_head_ct") && !bench::cranium()) return {};
    std::vector<std::string> notes;
    return paper::cut_models(folder, notes);
}

TEST(PaperModels, SharingSavesFourFifthsOfThePoints) {
    const auto all = models();
    if (all.empty()) GTEST_SKIP() << "neither vhf_head_ct nor Cranium is there";
    for (const paper::Model& model : all) {
        const auto classic = extract_isosurface_classic(model.volume, model.isovalue).points.size();
        const auto shared = extract_isosurface(model.volume, model.isovalue).points.size();
        EXPECT_LE(static_cast<double>(shared), 0.2 * static_cast<double>(classic)) << model.name;
    }
}

TEST(PaperModels, SnappingSavesAQuarterMoreWithoutSliversOrRoughness) {
    constexpr double kSnap = 0.3;
    const auto all = models();
    if (all.empty()) GTEST_SKIP() << "neither vhf_head_ct nor Cranium is there";
    for (const paper::Model& model : all) {
        const auto& spacing = model.volume.geometry().spacing;
        const double longest = *std::max_element(spacing.begin(), spacing.end());
        const Mesh before = extract_isosurface(model.volume, model.isovalue);
        const Mesh after = extract_isosurface(model.volume, model.isovalue, {.snap = kSnap});
        EXPECT_EQ(manifold_fault(after, true), "") << model.name;
        EXPECT_LE(static_cast<double>(after.points.size()), 0.75 * static_cast<double>(before.points.size()))
            << model.name;
        EXPECT_LT(triangle_quality(before).smallest_angle, 0.1) << model.name;
        EXPECT_GE(triangle_quality(after).smallest_angle, 5) << model.name;
        EXPECT_LE(roughness(after, 3).roughness, roughness(before, 3).roughness) << model.name;
        EXPECT_LE(mesh_distance(before, after, {.samples = 50'000}).max, kSnap * longest + 1e-4)
            << model.name;
        const MeshMeasures one = measure(before), other = measure(after);
        EXPECT_EQ(other.euler_characteristic, one.euler_characteristic) << model.name;
        EXPECT_EQ(other.components, one.components) << model.name;
        EXPECT_EQ(other.nonmanifold_edges, 0) << model.name;
    }
}

TEST(PaperModels, SnappingLeavesNoSliverInWholeScans) {
    const char* data = std::getenv("MARROW_TEST_DATA");
    int scans = 0;
    for (const char* name : {"vhf_head_ct", "vhf_ankle_ct"}) {
        const std::filesystem::path folder = std::filesystem::path(data != nullptr ? data : "") / name;
        if (!std::filesystem::exists(folder)) continue;
        ++scans;
        const Volume scan = read_scan(folder);
        for (const double isovalue : {225.5, 226.0, -300.5}) {
            const Mesh mesh = extract_isosurface(scan, isovalue, {.closed = true, .snap = 0.3});
            EXPECT_GE(triangle_quality(mesh).smallest_angle, 4.6) << name << " at " << isovalue;
            EXPECT_EQ(manifold_fault(mesh), "") << name << " at " << isovalue;
        }
    }
    if (scans == 0) GTEST_SKIP() << "neither vhf_head_ct nor vhf_ankle_ct is there";
}

}  // namespace
}  // namespace marrow::test
