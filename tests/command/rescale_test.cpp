// Scans whose values have a fraction: samples stay as stored, and all numbers of the command line are values.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "support/command_line.h"
#include "support/scan_files.h"

namespace marrow::test {
namespace {

using Json = nlohmann::json;

// A frame of bone with a thin wall across it, in air: the samples are 2643 more than in ThinWallScan.
class RescaledScan : public testing::Test {
  protected:
    void SetUp() override {
        write(scan, 1, -2643.4f);
        write(stored, 0, 0);
    }
    static void write(const std::string& file, float slope, float intercept) {
        NiftiWriter header;
        header.dim = {3, 40, 40, 24};
        header.srow = {{{1, 0, 0, 5}, {0, 1, 0, 6}, {0, 0, 2, 7}}};
        header.sform_code = 1;
        header.slope = slope;
        header.intercept = intercept;
        std::vector<std::int16_t> samples;
        for (int z = 0; z < 24; ++z) {
            for (int y = 0; y < 40; ++y) {
                for (int x = 0; x < 40; ++x) {
                    const bool within = x > 6 && x < 33 && y > 6 && y < 33 && z > 6 && z < 17;
                    const bool frame = within && !(x > 11 && x < 28 && y > 11 && y < 28);
                    const bool wall = within && !frame && z == 12;
                    const int noise = (x * 7 + y * 13 + z * 5) % 11 - 5;
                    samples.push_back(static_cast<std::int16_t>((frame ? 3843 : wall ? 2543 : 1643) + noise));
                }
            }
        }
        write_file(file, header.header() + bytes_of(samples));
    }
    static Outcome surface(const std::string& of, const std::string& mesh, std::vector<std::string> options) {
        options.insert(options.begin(), {of, "-o", mesh});
        const Outcome outcome = marrow_with(options);
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        return outcome;
    }

    const double intercept = -2643.4f;
    const TemporaryFolder folder;
    const std::string scan = folder / "ct.nii", stored = folder / "stored.nii";
    const std::string mesh = folder / "a.ply", other = folder / "b.ply";
};

TEST_F(RescaledScan, TheSurfaceIsThatOfTheStoredSamples) {
    surface(scan, mesh, {"--isovalue", "225.5"});
    surface(stored, other, {"--isovalue", fmt::format("{}", 225.5 - intercept)});
    EXPECT_EQ(read_file(mesh), read_file(other));
    surface(scan, other, {"--isovalue", "225.5", "--max-memory", "1G"});
    EXPECT_EQ(read_file(mesh), read_file(other));
    surface(scan, mesh, {"--isovalue", "225.5", "--open", "--crop", "vox:3,30,4,31,5,20"});
    surface(stored, other,
            {"--isovalue", fmt::format("{}", 225.5 - intercept), "--open", "--crop", "vox:3,30,4,31,5,20"});
    EXPECT_EQ(read_file(mesh), read_file(other));
}

TEST_F(RescaledScan, FiltersWorkOnValues) {
    for (const std::vector<std::string>& filter :
         {std::vector<std::string>{"--median", "1"}, {"--blur", "0.8"}, {"--isotropic", "1.3"}}) {
        std::vector<std::string> options{"--isovalue", "-300.2", "--json"};
        options.insert(options.end(), filter.begin(), filter.end());
        const Json of_values = Json::parse(surface(scan, mesh, options).out);
        options[1] = fmt::format("{}", -300.2 - intercept);
        const Json of_samples = Json::parse(surface(stored, other, options).out);
        const double volume = of_samples["volume_mm3"];
        EXPECT_NEAR(of_values["volume_mm3"], volume, 1e-4 * volume) << filter[0];
    }
}

TEST_F(RescaledScan, InfoSaysValuesAndWhatTheyAreMadeOf) {
    const Json values = Json::parse(marrow_with({"info", "--json", scan}).out);
    EXPECT_EQ(values["values"]["type"], "int16");
    EXPECT_NEAR(values["values"]["lower"], 1638 + intercept, 1e-9);
    EXPECT_NEAR(values["values"]["upper"], 3848 + intercept, 1e-9);
    EXPECT_EQ(values["values"]["rescale"]["slope"], 1);
    EXPECT_EQ(values["values"]["rescale"]["intercept"], intercept);
    EXPECT_EQ(values["values"]["may_be_hounsfield_units"], true);
    EXPECT_EQ(values["series"][0]["memory_bytes"], 40 * 40 * 24 * 2);
    const Outcome text = marrow_with({"info", scan});
    EXPECT_NE(text.out.find("int16 - 2643.4 from -1005.4 to 1204.6, probably Hounsfield"), std::string::npos)
        << text.out;
    write(scan, 0.5, 0);
    EXPECT_NE(marrow_with({"info", scan}).out.find("int16 * 0.5 from 819 to 1924,"), std::string::npos);
}

TEST_F(RescaledScan, OtsuPresetsTrustAndTheAlarmAreOfValues) {
    const Outcome outcome = surface(scan, mesh, {"--type", "bone", "--trust", "--json"});
    EXPECT_NE(outcome.err.find("--keep-thin restores them"), std::string::npos) << outcome.err;
    const Json bone = Json::parse(outcome.out);
    EXPECT_EQ(bone["isovalue"], 225.5);
    EXPECT_NEAR(bone["thin_walls"]["area_mm2"], 16 * 16, 25);
    EXPECT_EQ(bone["trust"]["isovalue_step"], 100);
    EXPECT_LT(bone["trust"]["noise"]["sigma"], 20);

    const auto number = [](const Outcome& of, const char* name) {
        return Json::parse(of.out)[name].get<double>();
    };
    const Outcome otsu = surface(scan, mesh, {"--isovalue", "otsu", "--json"}),
                  of_stored = surface(stored, other, {"--isovalue", "otsu", "--json"});
    EXPECT_NEAR(number(otsu, "isovalue"), number(of_stored, "isovalue") + intercept, 1e-9);
    const Outcome none = marrow_with({scan, "-o", mesh, "--isovalue", "9000"});
    EXPECT_NE(none.err.find("samples range from -1005.4 to 1204.6"), std::string::npos) << none.err;
}

TEST_F(RescaledScan, SweepsAreOfValues) {
    const auto swept = [](const std::string& of, double from, double to) {
        return Json::parse(marrow_with({"sweep", of, "--json", "--samples", "5", "--from",
                                        fmt::format("{}", from), "--to", fmt::format("{}", to)})
                               .out)["sweep"];
    };
    const Json of_values = swept(scan, -700.7, 900.2),
               of_samples = swept(stored, -700.7 - intercept, 900.2 - intercept);
    ASSERT_EQ(of_values.size(), 5u);
    EXPECT_EQ(of_values[0]["isovalue"], -700.7);
    for (std::size_t i = 0; i < 5; ++i) {
        EXPECT_EQ(of_values[i]["triangles"], of_samples[i]["triangles"]);
        EXPECT_NEAR(of_values[i]["area_mm2"], of_samples[i]["area_mm2"].get<double>(), 1e-3);
    }
}

// Labels are values: 2 where 4 is stored.
TEST_F(RescaledScan, LabelsAreValues) {
    EXPECT_NE(marrow_with({scan, "-o", mesh, "--labels"}).err.find("not integers"), std::string::npos);
    NiftiWriter header;
    header.dim = {3, 8, 8, 8};
    header.slope = 0.5;
    std::vector<std::int16_t> samples(512, 0);
    for (int z = 2; z < 6; ++z) {
        for (int i = 16; i < 48; ++i) samples[static_cast<std::size_t>(64 * z + i)] = 4;
    }
    write_file(scan, header.header() + bytes_of(samples));
    const Json labels =
        Json::parse(marrow_with({scan, "-o", folder / "labels.vtp", "--labels", "--json"}).out)["surfaces"];
    ASSERT_EQ(labels.size(), 1u);
    EXPECT_EQ(labels[0]["label"], 2);
}

}  // namespace
}  // namespace marrow::test
