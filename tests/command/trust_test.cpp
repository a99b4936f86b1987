// `--trust`, `--keep-thin` and `--no-alarm` on the command line.
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <marrow/measure.h>
#include <marrow/mesh_check.h>
#include <marrow/mesh_io.h>

#include "support/command_line.h"

namespace marrow::test {
namespace {

using Json = nlohmann::json;

// A box of bone in air, open on two sides, with a thin wall across it: too thin for the isovalue of bone.
class ThinWallScan : public testing::Test {
  protected:
    void SetUp() override {
        write_nrrd(scan, 40, 40, 24, [](int x, int y, int z) {
            const bool within = x > 6 && x < 33 && y > 6 && y < 33 && z > 6 && z < 17;
            const bool frame = within && !(x > 11 && x < 28 && y > 11 && y < 28);
            const bool wall = within && !frame && z == 12;
            const int noise = (x * 7 + y * 13 + z * 5) % 11 - 5;
            return (frame ? 1200 : wall ? -100 : -1000) + noise;
        });
    }
    Outcome bone(std::vector<std::string> options) {
        options.insert(options.begin(), {scan, "--type", "bone", "-o", mesh});
        return marrow_with(options);
    }

    const TemporaryFolder folder;
    const std::string scan = folder / "frame.nrrd";
    const std::string mesh = folder / "frame.ply";
};

TEST_F(ThinWallScan, TheAlarmSaysHowMuchAndWhere) {
    const Outcome outcome = bone({"--json"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_NE(outcome.err.find("--keep-thin restores them"), std::string::npos) << outcome.err;
    const Json walls = Json::parse(outcome.out)["thin_walls"];
    EXPECT_NEAR(walls["area_mm2"].get<double>(), 16 * 16, 25);
    EXPECT_EQ(walls["restored"], false);
    EXPECT_EQ(walls["places"], 1);
    EXPECT_NEAR(walls["largest"][0]["position_mm"][0].get<double>(), 10 + 19.5, 2);
    EXPECT_NEAR(walls["largest"][0]["position_mm"][2].get<double>(), 30 + 2 * 12, 0.1);
}

TEST_F(ThinWallScan, KeepThinClosesTheOpening) {
    EXPECT_EQ(bone({}).code, 0);
    EXPECT_EQ(check_mesh(read_mesh(mesh)).genus, 1);
    const Outcome outcome = bone({"--keep-thin", "--topology"});
    EXPECT_EQ(outcome.code, 0);
    EXPECT_EQ(outcome.err.find("--keep-thin"), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.out.find("mm2 in 1 place restored\n"), std::string::npos) << outcome.out;
    const MeshCheck check = check_mesh(read_mesh(mesh));
    EXPECT_TRUE(check.is_sound());
    EXPECT_EQ(check.genus, 0);
}

TEST_F(ThinWallScan, TheAlarmIsForBoneAndCanBeTurnedOff) {
    const std::string with_alarm = (bone({}), read_file(mesh));
    const Outcome silent = bone({"--no-alarm"});
    EXPECT_EQ(silent.err.find("thin"), std::string::npos) << silent.err;
    EXPECT_EQ(read_file(mesh), with_alarm);
    const Outcome other = marrow_with({scan, "--isovalue", "225.5", "-o", mesh});
    EXPECT_EQ(other.err.find("thin"), std::string::npos) << other.err;
    EXPECT_EQ(bone({"--no-alarm", "--keep-thin"}).code, kUsage);
}

TEST_F(ThinWallScan, TrustIsInTheSummaryInJsonAndInTheFile) {
    const Outcome text = bone({"--trust"});
    EXPECT_NE(text.out.find("100 HU more or less move the surface by"), std::string::npos) << text.out;
    EXPECT_NE(text.out.find("noise:"), std::string::npos) << text.out;
    const std::string header = read_file(mesh).substr(0, 1000);
    EXPECT_NE(header.find("property float shift_mm\nproperty float noise_mm\nproperty float thin_wall\n"),
              std::string::npos)
        << header;
    EXPECT_NE(header.find("comment shift_mm: mm that the surface moves if the isovalue changes by 100 HU\n"),
              std::string::npos)
        << header;
    const Json trust = Json::parse(bone({"--trust", "--json"}).out)["trust"];
    EXPECT_EQ(trust["isovalue_step"], 100);
    EXPECT_EQ(trust["cap_mm"], 2);
    EXPECT_GT(trust["shift_mm"]["median"].get<double>(), 0);
    EXPECT_LE(trust["shift_mm"]["median"], trust["shift_mm"]["percentile_90"]);
    EXPECT_TRUE(Json::parse(bone({"--json"}).out)["trust"].is_null());
    // The reader takes the file as before, and the check of what was written passes.
    EXPECT_EQ(bone({"--trust", "--verify"}).code, 0);
    for (const char* file : {"a.vtp", "a.glb", "a.stl", "a.3mf"})
        EXPECT_EQ(marrow_with({scan, "--type", "bone", "-o", folder / file, "--trust", "--verify"}).code, 0)
            << file;
}

TEST_F(ThinWallScan, TrustDescribesTheSurfaceAfterItsSteps) {
    EXPECT_EQ(bone({"--trust", "--smooth", "10", "--triangles", "1000"}).code, 0);
    const Json json = Json::parse(bone({"--trust", "--smooth", "10", "--triangles", "1000", "--json"}).out);
    EXPECT_LE(json["triangles"], 1000);
    EXPECT_GT(json["trust"]["shift_mm"]["median"].get<double>(), 0);
}

TEST_F(ThinWallScan, SeveralSurfacesHaveTheirOwn) {
    const Outcome outcome = marrow_with({scan, "--type", "bone", "--type", "skin", "-o", folder / "both.vtp",
                                         "--trust", "--no-alarm", "--json"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    for (const Json& surface : Json::parse(outcome.out)["surfaces"])
        EXPECT_GT(surface["trust"]["shift_mm"]["median"].get<double>(), 0);
}

// The step of 100 is in Hounsfield units, which NRRD does not promise.
TEST_F(ThinWallScan, TrustSaysThatItAssumesHounsfieldUnits) {
    const auto run = [&](std::vector<std::string> options) {
        options.insert(options.begin(), {scan, "--isovalue", "225.5", "-o", mesh});
        return marrow_with(options).err;
    };
    const std::string assumption = "assumed to be Hounsfield units";
    EXPECT_NE(run({"--trust"}).find(assumption), std::string::npos);
    EXPECT_EQ(run({}).find(assumption), std::string::npos);
    const std::string both = bone({"--trust"}).err;
    EXPECT_EQ(both.find(assumption), both.rfind(assumption)) << both;
}

// Blocks of 5 samples have no window of 7 x 7 samples in tissue.
TEST_F(ThinWallScan, NoiseCanBeUnknown) {
    write_nrrd(scan, 40, 40, 24, [](int x, int y, int z) {
        const bool frame = x > 6 && x < 33 && y > 6 && y < 33 && z > 6 && z < 17 && x % 6 > 0 &&
                           !(x > 11 && x < 28 && y > 11 && y < 28);
        const bool wall = x > 11 && x < 28 && y > 11 && y < 28 && z == 12;
        return frame ? 1200 : wall ? -100 : -1000;
    });
    const Outcome outcome = bone({"--trust", "--json"});
    const Json json = Json::parse(outcome.out);
    ASSERT_EQ(json["trust"]["noise"]["windows"], 0) << outcome.out;
    for (const char* number : {"sigma", "lowest", "highest", "local_deviation", "slices", "laplacian"})
        EXPECT_TRUE(json["trust"]["noise"][number].is_null()) << number;
    EXPECT_TRUE(json["trust"]["noise_mm"].is_null());
    EXPECT_NE(outcome.err.find("the noise of the scan is unknown"), std::string::npos) << outcome.err;
    EXPECT_NE(read_file(mesh).find("comment noise_mm: 0, as the noise is unknown\n"), std::string::npos);
}

// Walls are looked for in bone only, and yet both have the same arrays, as one file needs.
TEST_F(ThinWallScan, SurfacesInOneFileHaveTheSameArrays) {
    const Outcome outcome =
        marrow_with({scan, "--type", "bone", "--type", "skin", "-o", folder / "both.vtp", "--trust"});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
}

}  // namespace
}  // namespace marrow::test
