// `marrow INPUT` on the command line: extraction, its options and its reports.
#include <array>
#include <cmath>
#include <fstream>
#include <numeric>
#include <string_view>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <marrow/mesh_io.h>
#include <marrow/version.h>

#include "outputs.h"
#include "support/command_line.h"

namespace marrow::test {
namespace {

using Json = nlohmann::json;
using Names = std::set<std::string>;
using testing::Test;

class CommandLine : public BallScan {
  protected:
    Outcome extract(std::vector<std::string> options) {
        options.insert(options.begin(), scan);
        return marrow_with(options);
    }
    Json extract_json(std::vector<std::string> options) {
        options.push_back("--json");
        const Outcome outcome = extract(options);
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        return Json::parse(outcome.out);
    }
    static std::vector<std::string> keys(const Json& json) {
        std::vector<std::string> result;
        for (const auto& [key, value] : json.items()) result.push_back(key);
        return result;
    }

    const std::string mesh = folder / "ball.ply";
};

TEST_F(CommandLine, WritesTheMeshAndSaysWhatItIs) {
    const Outcome outcome = extract({"-o", mesh, "--isovalue", "0"});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(outcome.err, "");
    const std::string header = read_file(mesh).substr(0, 400);
    const auto count = [&](const std::string& element) {
        return std::stoi(header.substr(header.find(element) + element.size()));
    };
    EXPECT_EQ(outcome.out, mesh + ": " + std::to_string(count("element vertex ")) + " points, " +
                               std::to_string(count("element face ")) + " triangles at isovalue 0\n");
}

TEST_F(CommandLine, JsonHoldsTheNumbersOfTheMesh) {
    const Json json = extract_json({"-o", mesh, "--isovalue", "0"});
    EXPECT_EQ(Json(keys(json)), Json({"area_mm2",
                                      "boundary_edges",
                                      "bounds_mm",
                                      "cavities",
                                      "components",
                                      "device",
                                      "euler_characteristic",
                                      "input",
                                      "isovalue",
                                      "nonmanifold_edges",
                                      "output",
                                      "peak_memory_bytes",
                                      "pieces",
                                      "points",
                                      "seconds",
                                      "steps",
                                      "thin_walls",
                                      "triangles",
                                      "trust",
                                      "verified",
                                      "volume_mm3",
                                      "warnings"}));
    EXPECT_EQ(json["input"]["format"], "NRRD");
    EXPECT_EQ(json["input"]["dims"], Json({24, 25, 13}));
    EXPECT_EQ(json["input"]["spacing_mm"], Json({1.0, 1.0, 2.0}));
    EXPECT_TRUE(json["input"]["modality"].is_null());
    EXPECT_EQ(json["device"], "cpu");
    EXPECT_EQ(json["components"], 1);
    EXPECT_EQ(json["pieces"], 1);
    EXPECT_EQ(json["cavities"], 0);
    EXPECT_EQ(json["boundary_edges"], 0);
    EXPECT_EQ(json["nonmanifold_edges"], 0);
    EXPECT_EQ(json["euler_characteristic"], 2);
    EXPECT_EQ(json["points"].get<int>() - json["triangles"].get<int>() / 2, 2);
    EXPECT_NEAR(json["volume_mm3"].get<double>() / (4.0 / 3 * 3.14159265 * 8 * 8 * 8), 1, 0.03);
    EXPECT_NEAR(json["area_mm2"].get<double>() / (4 * 3.14159265 * 8 * 8), 1, 0.03);
    EXPECT_NEAR(json["bounds_mm"][0][1].get<double>(), 20 + 12 - 8, 0.1);
    EXPECT_EQ(json["output"], mesh);
    EXPECT_EQ(json["warnings"], Json::array());
    EXPECT_EQ(json["seconds"].size(), 7u);
    EXPECT_GE(json["seconds"]["total"].get<double>(),
              json["seconds"]["read"].get<double>() + json["seconds"]["extract"].get<double>());
    EXPECT_GT(json["peak_memory_bytes"].get<std::int64_t>(), 1 << 20);
}

TEST_F(CommandLine, SaysThatTheFilesWereVerified) {
    const Outcome outcome = extract({"-o", mesh, "--isovalue", "0", "--verify"});
    EXPECT_NE(outcome.out.find("verified: all "), outcome.out.npos) << outcome.out;
    EXPECT_EQ(extract({"-o", mesh, "--isovalue", "0"}).out.find("verified"), std::string::npos);
    EXPECT_EQ(extract_json({"-o", mesh, "--isovalue", "0", "--verify"})["verified"], true);
}

// A hollow ball is one piece with a cavity, however many components its surface has.
TEST_F(CommandLine, CountsPiecesAndCavities) {
    write_nrrd(scan, 24, 24, 24, [](int x, int y, int z) {
        const double distance = std::hypot(x - 12, y - 12, z - 12);
        return distance < 9 && distance > 4 ? 1000 : -1000;
    });
    const Json json = extract_json({"-o", mesh, "--isovalue", "0", "--components", "1"});
    EXPECT_EQ(json["components"], 2);
    EXPECT_EQ(json["pieces"], 1);
    EXPECT_EQ(json["cavities"], 1);
    const std::string check = marrow_with({"check", mesh}).out;
    EXPECT_NE(check.find("1, with 1 cavity"), check.npos) << check;
}

// Few triangles cannot follow a ball. The note says what happened to the shape, not that nothing did.
TEST_F(CommandLine, WarnsOfReductionThatMovesTheSurfaceByMoreThanASample) {
    const auto err = [&](const char* triangles) {
        return extract({"-o", mesh, "--isovalue", "0", "--triangles", triangles}).err;
    };
    EXPECT_NE(err("4").find("more than the 2 mm between samples"), std::string::npos) << err("4");
    EXPECT_EQ(err("400").find("between samples"), std::string::npos) << err("400");
}

TEST_F(CommandLine, RasNegatesXAndY) {
    const Json lps = extract_json({"-o", mesh, "--isovalue", "0"})["bounds_mm"];
    const std::string first = read_file(mesh);
    const Json ras = extract_json({"-o", mesh, "--isovalue", "0", "--space", "RAS"})["bounds_mm"];
    EXPECT_NE(read_file(mesh), first);
    for (int axis = 0; axis < 2; ++axis) {
        EXPECT_EQ(ras[0][axis], -lps[1][axis].get<double>());
        EXPECT_EQ(ras[1][axis], -lps[0][axis].get<double>());
    }
    EXPECT_EQ(ras[0][2], lps[0][2]);
}

TEST_F(CommandLine, ClosesTheSurfaceAtTheBorderOfTheScan) {
    write_nrrd(scan, 24, 25, 13, ball(0, 12, 6, 8));
    EXPECT_EQ(extract_json({"-o", mesh, "--isovalue", "0"})["boundary_edges"], 0);
    const Json open = extract_json({"-o", mesh, "--isovalue", "0", "--open", "--smooth", "5"});
    EXPECT_GT(open["boundary_edges"], 0);
    EXPECT_TRUE(open["volume_mm3"].is_null());
    EXPECT_EQ(open["steps"][0]["volume_mm3"], Json::parse("[null, null]"));
}

TEST_F(CommandLine, StatesNoVolumeOfAFlatSurface) {
    write_nrrd(scan, 8, 9, 10, [](double, double, double z) { return 10 * (z - 4.5); });
    const Outcome outcome = extract({"-o", mesh, "--isovalue", "0", "--open", "--smooth", "5"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("of 112 triangles, area "), outcome.out.npos) << outcome.out;
}

TEST_F(CommandLine, KeepsOnlyTheLargestComponent) {
    const auto large = ball(7, 12, 6, 6), small = ball(19, 12, 6, 4);
    write_nrrd(scan, 24, 25, 13,
               [&](int x, int y, int z) { return std::max(large(x, y, z), small(x, y, z)); });
    EXPECT_EQ(extract_json({"-o", mesh, "--isovalue", "0"})["components"], 2);
    const Json json = extract_json({"-o", mesh, "--isovalue", "0", "--largest"});
    EXPECT_EQ(json["components"], 1);
    EXPECT_LT(json["bounds_mm"][1][0].get<double>(), 10 + 14);
}

TEST_F(CommandLine, SnapsToFewerPoints) {
    const Json plain = extract_json({"-o", mesh, "--isovalue", "0"});
    const Json snapped = extract_json({"-o", mesh, "--isovalue", "0", "--snap", "0.3"});
    EXPECT_LE(snapped["points"].get<double>(), 0.75 * plain["points"].get<double>());
    EXPECT_EQ(snapped["boundary_edges"], 0);
    EXPECT_EQ(snapped["nonmanifold_edges"], 0);
    EXPECT_EQ(snapped["euler_characteristic"], plain["euler_characteristic"]);
    EXPECT_EQ(extract_json({"-o", mesh, "--isovalue", "0", "--snap", "0"})["points"], plain["points"]);
}

// A wall one sample thick, askew in the grid.
TEST_F(CommandLine, TopologyKeepsThinWallsWhole) {
    write_nrrd(scan, 24, 25, 13, [](int x, int y, int) { return x - y == 3 ? 100 : -50; });
    const Json plain = extract_json({"-o", mesh, "--isovalue", "0"});
    EXPECT_GT(plain["components"].get<int>(), 10);
    const Json exact = extract_json({"-o", mesh, "--isovalue", "0", "--topology"});
    EXPECT_EQ(exact["components"], 1);
    EXPECT_EQ(exact["boundary_edges"], 0);
    EXPECT_EQ(exact["nonmanifold_edges"], 0);
    EXPECT_EQ(exact["euler_characteristic"], 2);
}

TEST_F(CommandLine, OtsuSeparatesDarkFromBright) {
    write_nrrd(scan, 24, 25, 13, [](int x, int, int) { return x < 12 ? -70 : 130; });
    EXPECT_NEAR(extract_json({"-o", mesh, "--isovalue", "otsu"})["isovalue"].get<double>(), 30, 1);
}

TEST_F(CommandLine, WritesSeveralSurfacesByName) {
    const Outcome outcome = extract({"-o", folder / "{name}.stl", "--isovalue", "0", "--isovalue", "5e2"});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(folder.files(), (Names{"0.stl", "5e2.stl", "ball.nrrd"}));
    EXPECT_GT(read_file(folder / "0.stl").size(), read_file(folder / "5e2.stl").size());
}

TEST_F(CommandLine, HasFivePresets) {
    const std::pair<const char*, double> presets[] = {
        {"bone", 225.5}, {"muscle", 9.5}, {"soft", -100.5}, {"fat", -150.5}, {"skin", -300.5}};
    for (const auto& [name, isovalue] : presets) {
        SCOPED_TRACE(name);
        const Json json = extract_json({"-o", folder / "a.stl", "--type", name});
        EXPECT_EQ(json["isovalue"], isovalue);
    }
}

TEST_F(CommandLine, WritesSeveralSurfacesToAFolder) {
    const Json json = extract_json({"-o", folder.path(), "--type", "bone", "--isovalue", "otsu"});
    EXPECT_EQ(folder.files(), (Names{"ball.nrrd", "bone.stl", "otsu.stl"}));
    ASSERT_EQ(json["surfaces"].size(), 2u);
    EXPECT_EQ(json["surfaces"][1]["name"], "bone");
    EXPECT_EQ(json["surfaces"][1]["isovalue"], 225.5);
    EXPECT_EQ(json["surfaces"][1]["output"], (folder / "bone.stl").string());
}

TEST_F(CommandLine, RefusesWhatMakesNoSense) {
    const std::vector<std::vector<std::string>> commands{
        {},
        {scan},
        {scan, "-o", mesh},
        {scan, "-o", folder / "a.xyz", "--isovalue", "0"},
        {scan, "-o", mesh, "--isovalue", "bright"},
        {scan, "-o", mesh, "--isovalue", "1,5"},
        {scan, "-o", mesh, "--isovalue", "nan"},
        {scan, "-o", mesh, "--isovalue", "inf"},
        {scan, "-o", mesh, "--type", "brain"},
        {scan, "-o", mesh, "--isovalue", "0", "--isovalue", "1"},
        {scan, "-o", folder / "{name}.stl", "--isovalue", "0", "--isovalue", "0"},
        {scan, "-o", folder / "{name}.stl", "--isovalue", "-300.5", "--type", "skin"},
        {scan, "-o", mesh, "--isovalue", "0", "--snap", "0.1", "--topology"},
        {scan, "-o", mesh, "--isovalue", "0", "--spacing", "1,2"},
        {scan, "-o", mesh, "--isovalue", "0", "--spacing", "1,2,0"},
        {scan, "-o", mesh, "--isovalue", "0", "--spacing", "1,2,3,4"},
        {scan, "-o", mesh, "--isovalue", "0", "--space", "LAS"},
        {scan, "-o", mesh, "--isovalue", "0", "--threads", "-1"},
        {scan, "-o", mesh, "--isovalue", "0", "--snap", "0.5"},
        {scan, "-o", mesh, "--isovalue", "0", "--snap", "-0.1"},
        {scan, "-o", mesh, "--isovalue", "0", "--components", "0"},
        {scan, "-o", mesh, "--isovalue", "0", "--snap", "nan"},
        {scan, "-o", mesh, "--isovalue", "0", "--snap", "0.3", "--max-memory", "1G"},
        {scan, "-o", mesh, "--isovalue", "0", "--picture", "a.jpg"},
        {scan, "-o", mesh, "--isovalue", "0", "--smoothest"},
        {scan, scan, "-o", mesh, "--isovalue", "0"},
        {"info"},
    };
    for (const auto& command : commands) {
        const Outcome outcome = marrow_with(command);
        EXPECT_EQ(outcome.code, 2) << testing::PrintToString(command) << outcome.err;
        EXPECT_NE(outcome.err, "");
    }
    EXPECT_EQ(folder.files(), Names{"ball.nrrd"});
}

// The least memory that the program says it needs, in MiB. The libraries of the test take a part of it.
int least_memory(const Outcome& refused) {
    const std::string at_least = "at least ";
    EXPECT_EQ(refused.code, kUnreadable);
    return std::stoi(refused.err.substr(refused.err.find(at_least) + at_least.size()));
}

// With the least memory, few slices fit.
TEST_F(CommandLine, SlabsGiveTheSameBytes) {
    write_nrrd(scan, 150, 140, 90, [](int x, int y, int z) {
        return 500 * std::sin(0.2 * x) * std::sin(0.15 * y) * std::cos(0.21 * z) +
               (7 * x + 11 * y + 13 * z) % 40;
    });
    for (const std::string ending : {".stl", ".ply"}) {
        for (const std::string space : {"LPS", "RAS"}) {
            const std::string whole = folder / ("whole" + ending), slabs = folder / ("slabs" + ending);
            ASSERT_EQ(extract({"-o", whole, "--isovalue", "100", "--space", space}).code, 0);
            for (const bool little : {false, true}) {
                const int least =
                    least_memory(extract({"-o", slabs, "--isovalue", "100", "--max-memory", "100K"}));
                // The test's own memory changes a little between the two.
                const std::string memory = little ? std::to_string(least + 16) + "MiB" : "2GB";
                const Json json = extract_json(
                    {"-o", slabs, "--isovalue", "100", "--space", space, "--max-memory", memory});
                EXPECT_TRUE(read_file(whole) == read_file(slabs)) << ending << space << memory;
                EXPECT_GT(json["triangles"], 10000);
                EXPECT_TRUE(json["components"].is_null());
            }
        }
    }
    const Names written{"ball.nrrd", "whole.stl", "whole.ply", "slabs.stl", "slabs.ply"};
    EXPECT_EQ(extract({"-o", folder / "a.obj", "--isovalue", "100", "--max-memory", "500MB"}).code, 2);
    EXPECT_EQ(extract({"-o", folder / "a.stl", "--isovalue", "100", "--max-memory", "100K"}).code, 3);
    EXPECT_EQ(extract({"-o", folder / "a.stl", "--isovalue", "900", "--max-memory", "500MB"}).code, 5);
    EXPECT_EQ(extract({"-o", folder / "a.stl", "--type", "bone", "--max-memory", "500MB"}).code, 2);
    EXPECT_EQ(extract({"-o", folder / "a.stl", "--isovalue", "100", "--max-memory", "much"}).code, 2);
    EXPECT_EQ(
        marrow_with({scan, "-o", folder / "a.stl", "--isovalue", "100", "--max-memory", "500MB"}, true).code,
        130);
    EXPECT_EQ(folder.files(), written);
}

TEST_F(CommandLine, SlabsWithoutASurfaceSayTheReason) {
    const auto refusal = [&](const std::string& isovalue, const char* more) {
        const Outcome outcome =
            extract({"-o", folder / "a.stl", "--isovalue", isovalue, "--max-memory", "500MB", more});
        EXPECT_EQ(outcome.code, 5);
        return outcome.err;
    };
    const auto says = [](const std::string& text, const std::string& part) {
        EXPECT_NE(text.find(part), text.npos) << text;
    };
    says(refusal("1001", "-v"), "no surface at isovalue 1001: all finite samples are on one side of it");
    write_nrrd(scan, 6, 5, 1, [](int x, int, int) { return x % 2 == 0 ? 0 : 9; });
    says(refusal("0.5", "--open"), "an open surface needs at least 2 samples along each axis");
    write_file(scan,
               "NRRD0004\ntype: float\ndimension: 3\nsizes: 2 2 2\nspacings: 1 1 1\nendian: little\n"
               "encoding: raw\n\n" +
                   std::string(32, '\xff'));
    says(refusal("0.5", "-v"), "no finite sample");
    EXPECT_EQ(folder.files(), Names{"ball.nrrd"});
}

TEST_F(CommandLine, FiltersTheScanInItsSpace) {
    // The scan is at (10, 20, 30) with samples 1 x 1 x 2 mm apart.
    const Json whole = extract_json({"-o", mesh, "--isovalue", "0"});
    const Json mm = extract_json({"-o", mesh, "--isovalue", "0", "--crop", "12,22.5,0,100,34,50"});
    EXPECT_EQ(mm["bounds_mm"][0][0], whole["bounds_mm"][0][0]);
    EXPECT_NEAR(mm["bounds_mm"][1][0].get<double>(), 22, 1) << "closed within a sample of the cut";
    const Json samples = extract_json({"-o", mesh, "--isovalue", "0", "--crop", "vox:2,12,0,24,2,10"});
    EXPECT_EQ(samples["bounds_mm"], mm["bounds_mm"]);
    const Json ras =
        extract_json({"-o", mesh, "--isovalue", "0", "--space", "RAS", "--crop", "-22.5,-12,-100,0,34,50"});
    EXPECT_EQ(ras["volume_mm3"], mm["volume_mm3"]);
    EXPECT_EQ(extract({"-o", mesh, "--isovalue", "0", "--crop", "vox:2,99,0,24,2,10"}).code, kUsage);
    EXPECT_EQ(extract({"-o", mesh, "--isovalue", "0", "--crop", "500,600,0,24,2,10"}).code, kUsage);

    const Json even =
        extract_json({"-o", mesh, "--isovalue", "0", "--median", "1", "--blur", "0.7", "--isotropic", "1"});
    EXPECT_NEAR(even["volume_mm3"].get<double>() / whole["volume_mm3"].get<double>(), 1, 0.1);
    EXPECT_GT(even["triangles"], whole["triangles"]);
}

TEST_F(CommandLine, ReportsEachStepAfterExtraction) {
    write_nrrd(scan, 40, 25, 13, [](int x, int y, int z) {
        return std::max({ball(12, 12, 6, 8)(x, y, z), ball(31, 12, 6, 4)(x, y, z),
                         x == 37 && y == 3 && z == 2 ? 900.0 : -1e3});
    });
    const std::vector<std::string> arguments{
        "-o",     mesh,  "--isovalue",  "0", "--clean-small", "20", "--smooth", "10", "--smooth-bound",
        "--keep", "0.5", "--max-error", "1", "--verify"};
    const Json json = extract_json(arguments);
    ASSERT_EQ(json["steps"].size(), 3u);
    // The summary has the same numbers, without all measures.
    const std::string summary = extract(arguments).out;
    for (const Json& step : json["steps"]) {
        const auto percent = [&](const char* name) {
            return 100 * (step[name][1].get<double>() / step[name][0].get<double>() - 1);
        };
        const std::string line = fmt::format("{} of {} triangles, volume {:+.3f} %, area {:+.3f} %",
                                             step["triangles"][1].get<int>(), step["triangles"][0].get<int>(),
                                             percent("volume_mm3"), percent("area_mm2"));
        EXPECT_NE(summary.find(line), summary.npos) << line << '\n' << summary;
    }
    EXPECT_EQ(json["steps"][0]["step"], "components");
    EXPECT_EQ(json["steps"][0]["components"], Json({3, 2}));
    EXPECT_EQ(json["steps"][1]["step"], "smooth");
    EXPECT_EQ(json["steps"][1]["deviation_mm"], Json());
    EXPECT_GT(json["steps"][1]["moved_mm"]["mean"], 0);
    EXPECT_GE(json["steps"][1]["held_back"], 0);
    EXPECT_EQ(json["steps"][2]["step"], "reduce");
    EXPECT_LE(json["steps"][2]["deviation_mm"]["max"], 1);
    const int before = json["steps"][2]["triangles"][0], after = json["triangles"];
    EXPECT_NEAR(after, before / 2, 2);
    EXPECT_EQ(json["boundary_edges"], 0);
    EXPECT_EQ(json["nonmanifold_edges"], 0);
    EXPECT_EQ(extract_json({"-o", mesh, "--isovalue", "0", "--components", "2"})["components"], 2);
    EXPECT_EQ(extract_json({"-o", mesh, "--isovalue", "0", "--triangles", "50"})["triangles"], 50);
    EXPECT_EQ(extract({"-o", mesh, "--isovalue", "0", "--clean-small", "1e9"}).code, 5);
    const Json bound =
        extract_json({"-o", mesh, "--isovalue", "0", "--smooth", "20", "--smooth-bound", "0.05mm"});
    EXPECT_NEAR(bound["steps"][0]["moved_mm"]["max"], 0.05, 1e-4);
    const Outcome text = extract({"-o", mesh, "--isovalue", "0", "--smooth", "5"});
    EXPECT_NE(text.out.find("\n  smooth:"), text.out.npos) << text.out;
}

TEST_F(CommandLine, RefusesStepsThatMakeNoSense) {
    for (const std::vector<std::string>& options :
         std::vector<std::vector<std::string>>{{"--keep", "0"},
                                               {"--keep", "1.5"},
                                               {"--keep", "0.5", "--triangles", "9"},
                                               {"--triangles", "0"},
                                               {"--max-error", "-1"},
                                               {"--smooth-bound"},
                                               {"--smooth", "5", "--smooth-bound", "0.5cm"},
                                               {"--smooth", "5", "--smooth-bound", "0"},
                                               {"--smooth", "-2"},
                                               {"--median", "17"},
                                               {"--blur", "nan"},
                                               {"--components", "-1"},
                                               {"--clean-small", "-5"},
                                               {"--crop", "1,2,3"},
                                               {"--crop", "5,1,0,9,0,9"},
                                               {"--crop", "vox:0.5,1,0,9,0,9"},
                                               {"--max-memory", "1G", "--smooth", "3"}}) {
        std::vector<std::string> all{"-o", mesh, "--isovalue", "0"};
        all.insert(all.end(), options.begin(), options.end());
        EXPECT_EQ(extract(all).code, 2) << options.front() << " " << options.back();
    }
    EXPECT_EQ(folder.files(), Names{"ball.nrrd"});
}

TEST_F(CommandLine, HelpsWithEachCommand) {
    const auto help = [](std::vector<std::string> command) {
        command.push_back("--help");
        const Outcome outcome = marrow_with(command);
        EXPECT_EQ(outcome.code, 0);
        return outcome.out;
    };
    const auto has = [](const std::string& text, const char* word) { return text.find(word) != text.npos; };
    const std::string all = help({});
    for (const char* command : {"  info ", "  check ", "  sweep ", "  terrain ", "  view "})
        EXPECT_TRUE(has(all, command)) << command << all;
    const std::string check = help({"check"});
    EXPECT_TRUE(has(check, "marrow check")) << check;
    for (const char* ending : {".stl", ".ply", ".obj", ".gz", ".vtp", ".3mf", ".glb"})
        EXPECT_TRUE(has(check, ending)) << ending;
    for (const char* command : {"check", "info", "sweep"}) {
        const std::string text = help({command});
        EXPECT_FALSE(has(text, "Presets")) << command;
        EXPECT_FALSE(has(text, "Order of the steps")) << command;
        EXPECT_TRUE(has(text, "Exit codes")) << command;
    }
    EXPECT_EQ(marrow_with({"-q", "terrain", "x"}).code, 2);
}

TEST_F(CommandLine, VerifiesEveryFormat) {
    for (const std::string name :
         {"a.stl", "a.ply", "a.obj", "a.vtp", "a.3mf", "a.glb", "a.stl.gz", "a.ply.gz", "a.obj.gz"}) {
        for (const bool open : {false, true}) {
            const Outcome outcome =
                extract({"-o", folder / name, "--isovalue", "-500", "--verify", open ? "--open" : "-v"});
            EXPECT_EQ(outcome.code, 0) << name << outcome.err;
        }
        EXPECT_EQ(marrow_with({"check", folder / name}).code, 0) << name;
    }
    for (const std::string name : {"a.obj", "a.vtp", "a.3mf", "a.glb"})
        EXPECT_EQ(extract({"-o", folder / name, "--isovalue", "0", "--isovalue", "500", "--verify"}).code, 0);
    EXPECT_EQ(extract({"-o", folder / "a.3mf", "--isovalue", "0", "--space", "RAS", "--verify"}).code, 0);
    EXPECT_EQ(extract({"--picture", folder / "a.png", "--isovalue", "0", "--verify"}).code, 2);
}

TEST_F(CommandLine, VerifyFindsAnotherMesh) {
    ASSERT_EQ(extract({"-o", mesh, "--isovalue", "0"}).code, 0);
    const Mesh written = read_mesh(mesh);
    const auto verify_as = [&](const Mesh& expected, Space space) {
        verify(std::array{MeshObject{expected}}, mesh, space);
    };
    EXPECT_NO_THROW(verify_as(written, Space::LPS));
    EXPECT_THROW(verify_as(written, Space::RAS), CheckFailed);
    Mesh other = written;
    for (Triangle& t : other.triangles) std::swap(t[0], t[1]);
    EXPECT_THROW(verify_as(other, Space::LPS), CheckFailed) << "inside out";
    other = written;
    other.triangles.pop_back();
    EXPECT_THROW(verify_as(other, Space::LPS), CheckFailed);
    other = written;
    for (Vec3f& p : other.points) p[0] = -p[0];
    EXPECT_THROW(verify_as(other, Space::LPS), CheckFailed);
    // In metres, a tiny coordinate is a step of the least floats.
    other = written;
    other.points[0][0] = 1.2e-42f;
    const std::filesystem::path in_metres = folder / "ball.glb";
    write_mesh(other, in_metres);
    EXPECT_NO_THROW(verify(std::array{MeshObject{other}}, in_metres, Space::LPS));
    other.points[0][0] = 1e-20f;
    EXPECT_THROW(verify(std::array{MeshObject{other}}, in_metres, Space::LPS), CheckFailed);
}

TEST_F(CommandLine, SaysTheRangeOfSamplesIfThereIsNoSurface) {
    for (const std::string isovalue : {"1001", "-2000"}) {
        const bool open = isovalue[0] == '-';  // capped, all inside has a surface: the box
        const Outcome outcome = extract({"-o", mesh, "--isovalue", isovalue, open ? "--open" : "-v"});
        EXPECT_EQ(outcome.code, 5);
        EXPECT_NE(
            outcome.err.find("no surface at isovalue " + isovalue + ": samples range from -1000 to 1000"),
            outcome.err.npos)
            << outcome.err;
    }
    EXPECT_EQ(folder.files(), Names{"ball.nrrd"});
}

// Blurring spreads padding, and what it leaves of it is neither padding nor a tissue.
TEST_F(CommandLine, OtsuDoesNotSeePadding) {
    write_nrrd(scan, 40, 40, 12, [](int x, int y, int) {
        const double r = std::hypot(x - 19.5, y - 19.5);
        return r > 18 ? -3024 : r > 9 ? -1000 : 40;
    });
    for (const std::vector<std::string>& filter :
         {std::vector<std::string>{}, {"--median", "1"}, {"--blur", "1"}, {"--isotropic", "0.7"}}) {
        std::vector<std::string> options{"-o", mesh, "--isovalue", "otsu"};
        options.insert(options.end(), filter.begin(), filter.end());
        const double isovalue = extract_json(options)["isovalue"];
        EXPECT_GT(isovalue, -1000) << (filter.empty() ? "no filter" : filter[0]);
        EXPECT_LT(isovalue, 40);
    }
}

TEST_F(CommandLine, AnOpenSurfaceNeedsTwoSlices) {
    write_nrrd(scan, 8, 9, 1, [](int x, int, int) { return x < 4 ? -100 : 100; });
    const Outcome outcome = extract({"-o", mesh, "--isovalue", "0", "--open"});
    EXPECT_EQ(outcome.code, 5);
    EXPECT_NE(outcome.err.find("leave --open out"), std::string::npos) << outcome.err;
    EXPECT_EQ(extract({"-o", mesh, "--isovalue", "0"}).code, 0);
}

TEST_F(CommandLine, NamesWholeNumbersWithAllTheirDigits) {
    std::array<std::uint32_t, 27> samples{};
    std::iota(samples.begin(), samples.end(), 1234567);
    std::ofstream(scan, std::ios::binary)
        << "NRRD0004\ntype: uint32\ndimension: 3\nsizes: 3 3 3\nspacings: 1 1 1\nendian: little\nencoding: "
           "raw\n\n"
        << std::string_view(reinterpret_cast<const char*>(samples.data()), sizeof samples);
    EXPECT_NE(extract({"-o", mesh, "--isovalue", "1300001"})
                  .err.find("no surface at isovalue 1300001: samples range from 1234567 to 1234593"),
              std::string::npos);
    EXPECT_NE(marrow_with({"info", scan}).out.find(" from 1234567 to 1234593, "), std::string::npos);
}

TEST_F(CommandLine, WritesNoneOfSeveralSurfacesIfOneIsEmpty) {
    EXPECT_EQ(extract({"-o", folder / "{name}.stl", "--isovalue", "0", "--isovalue", "5000"}).code, 5);
    EXPECT_EQ(folder.files(), Names{"ball.nrrd"});
}

TEST_F(CommandLine, AssumesHounsfieldUnitsIfThereIsAirAndSaysSo) {
    const Outcome outcome = extract({"-o", mesh, "--type", "bone"});
    EXPECT_EQ(outcome.code, 0);
    EXPECT_NE(outcome.err.find("warning: NRRD does not say whether this is CT"), outcome.err.npos)
        << outcome.err;
    EXPECT_EQ(extract_json({"-o", mesh, "--type", "skin", "-q"})["isovalue"], -300.5);
}

TEST_F(CommandLine, RefusesPresetsWithoutHounsfieldUnits) {
    write_nrrd(scan, 24, 25, 13, [](int x, int, int) { return 40 * x; });
    const Outcome outcome = extract({"-o", mesh, "--type", "bone"});
    EXPECT_EQ(outcome.code, 2);
    EXPECT_NE(outcome.err.find("--isovalue otsu"), outcome.err.npos) << outcome.err;
    EXPECT_EQ(folder.files(), Names{"ball.nrrd"});
}

TEST_F(CommandLine, SaysWhichSurfacesAreTooMany) {
    const std::string files = folder / "{name}.stl";
    const std::vector<std::pair<std::vector<std::string>, std::string>> cases{
        {{"--isovalue", "0", "--isovalue", "0.0"}, "the surfaces 0 and 0.0 have the same isovalue"},
        {{"--isovalue", "otsu", "--isovalue", "otsu"}, "the surface otsu is given twice"},
        {{"--isovalue", "0", "--isovalue", "1", "--max-memory", "1G"}, "one surface at a time"}};
    for (auto [arguments, why] : cases) {
        arguments.insert(arguments.begin(), {"-o", files});
        const Outcome outcome = extract(arguments);
        EXPECT_EQ(outcome.code, 2);
        EXPECT_NE(outcome.err.find(why), outcome.err.npos) << outcome.err;
    }
    EXPECT_EQ(folder.files(), Names{"ball.nrrd"});
}

TEST_F(CommandLine, SaysWhatIsWrongWithANameThatIsTooLong) {
    for (const std::string& file : {std::string(300, 'a') + ".stl", std::string(300, 'a') + "/b.stl"}) {
        const Outcome outcome = extract({"-o", folder / file, "--isovalue", "0"});
        EXPECT_EQ(outcome.code, 3);
        EXPECT_EQ(outcome.err.find("marrow: cannot write '"), 0u) << outcome.err;
        EXPECT_NE(outcome.err.find("': File name too long\n"), outcome.err.npos) << outcome.err;
    }
}

TEST_F(CommandLine, RefusesOtsusMethodWhereItHasNothingToSeparate) {
    write_nrrd(scan, 5, 6, 7, [](int, int, int) { return 40; });
    const Outcome outcome = extract({"-o", mesh, "--isovalue", "otsu"});
    EXPECT_EQ(outcome.code, 2);
    EXPECT_NE(outcome.err.find("all samples are 40: give --isovalue N"), outcome.err.npos) << outcome.err;
}

// Changes a line of the header of an NRRD file.
void set_field(const std::filesystem::path& file, const std::string& name, const std::string& value) {
    std::string text = read_file(file);
    const std::size_t at = text.find(name);
    ASSERT_NE(at, text.npos);
    text.replace(at, text.find('\n', at) - at, name + value);
    write_file(file, text);
}

// A file of STL has no list of points: where float32 cannot separate them, its readers join them.
TEST_F(CommandLine, WarnsWhereCoordinatesAreTooLargeForStl) {
    set_field(scan, "space origin: ", "(1e5,0,0)");
    const auto warns = [&](const std::string& name, const std::vector<std::string>& more) {
        std::vector<std::string> arguments{"-o", folder / name, "--isovalue", "0"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        const Outcome outcome = extract(arguments);
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        return outcome.err.find("float32") != outcome.err.npos;
    };
    for (const char* const name : {"a.stl", "a.stl.gz", "a.dcm"}) EXPECT_TRUE(warns(name, {})) << name;
    EXPECT_TRUE(warns("a.stl", {"--max-memory", "1G"}));
    EXPECT_FALSE(warns("a.ply", {}));
    EXPECT_FALSE(warns("a.ply", {"--max-memory", "1G"}));
}

TEST_F(CommandLine, WarnsWhereFloatRoundsTheSurface) {
    set_field(scan, "space origin: ", "(1e7,0,0)");
    const auto warns = [&](const std::string& name, const std::vector<std::string>& more) {
        std::vector<std::string> arguments{"-o", folder / name};
        arguments.insert(arguments.end(), more.begin(), more.end());
        const Outcome outcome = extract(arguments);
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        return outcome.err.find("float32 rounds them by up to 0.6 of") != outcome.err.npos;
    };
    for (const char* const name : {"a.stl", "a.ply", "a.3mf"})
        EXPECT_TRUE(warns(name, {"--isovalue", "0"})) << name;
    EXPECT_TRUE(warns("a.ply", {"--isovalue", "0", "--max-memory", "1G"}));
    EXPECT_TRUE(warns("a.ply", {"--labels", "--only", "1000"}));
}

TEST_F(CommandLine, RefusesAGeometryWithTheFilesName) {
    set_field(scan, "space directions: ", "(1,0,0) (2,0,0) (0,0,1)");
    const Outcome outcome = extract({"-o", mesh, "--isovalue", "0"});
    EXPECT_EQ(outcome.code, kGeometry);
    EXPECT_NE(outcome.err.find("ball.nrrd': volume: the direction matrix is singular"), outcome.err.npos)
        << outcome.err;
}

TEST_F(CommandLine, SaysWhyItCannotReadOrWrite) {
    write_file(folder / "text.dcm",
               "This is not a DICOM file, but it is long enough to look at its preamble.\n");
    write_file(folder / "cut.nii", std::string("\x5c\x01\0\0", 4) + std::string(344, '\0'));
    std::filesystem::create_directory(folder / "empty");
    const Names before = folder.files();
    const std::vector<std::pair<std::string, std::string>> pairs{
        {folder / "missing.nrrd", mesh},     {folder / "text.dcm", mesh},
        {folder / "cut.nii", mesh},          {folder / "empty", mesh},
        {scan, folder / "missing/ball.ply"}, {scan, folder / "text.dcm/ball.ply"},
    };
    for (const auto& [input, output] : pairs) {
        const Outcome outcome = marrow_with({input, "-o", output, "--isovalue", "0"});
        EXPECT_EQ(outcome.code, 3) << input << " " << outcome.err;
        EXPECT_EQ(outcome.err.find("marrow: "), 0u);
        EXPECT_EQ(outcome.err.find('\n'), outcome.err.size() - 1) << outcome.err;
        EXPECT_EQ(outcome.out, "");
    }
    EXPECT_EQ(folder.files(), before);
}

TEST_F(CommandLine, LeavesNoTraceWhenCancelled) {
    write_file(mesh, "old");
    const Outcome outcome = marrow_with({scan, "-o", mesh, "--isovalue", "0"}, true);
    EXPECT_EQ(outcome.code, 130);
    EXPECT_EQ(outcome.err, "marrow: cancelled\n");
    EXPECT_EQ(read_file(mesh), "old");
    EXPECT_EQ(folder.files(), (Names{"ball.nrrd", "ball.ply"}));
}

TEST_F(CommandLine, QuietSaysNothingAndVerboseSaysTheStages) {
    const Outcome quiet = extract({"-o", mesh, "--type", "bone", "-q"});
    EXPECT_EQ(quiet.code, 0);
    EXPECT_EQ(quiet.out + quiet.err, "");
    const Outcome verbose = extract({"-o", mesh, "--isovalue", "0", "-v"});
    for (const char* stage : {"read ", "extract ", "write "})
        EXPECT_NE(verbose.err.find(stage), verbose.err.npos) << verbose.err;
}

TEST_F(CommandLine, FailsWhenTheResultsCannotBePrinted) {
    std::ofstream full("/dev/full");
    std::ostringstream err;
    const char* argv[] = {"marrow", scan.c_str(), "-o", mesh.c_str(), "--isovalue", "0"};
    EXPECT_EQ(run_marrow(std::size(argv), argv, {full, err}, std::atomic<bool>{false}), 3);
    EXPECT_EQ(err.str(), "marrow: cannot write the results to standard output\n");
}

TEST_F(CommandLine, InfoSaysWhatIsThere) {
    const Outcome text = marrow_with({"info", scan});
    EXPECT_EQ(text.code, 0) << text.err;
    EXPECT_NE(text.out.find("24 x 25 x 13"), text.out.npos) << text.out;
    EXPECT_NE(text.out.find("1 x 1 x 2 mm"), text.out.npos) << text.out;
    const Json json = Json::parse(marrow_with({"info", scan, "--json"}).out);
    EXPECT_EQ(json["format"], "NRRD");
    EXPECT_EQ(json["series"][0]["dims"], Json({24, 25, 13}));
    EXPECT_EQ(marrow_with({"info", folder / "missing"}).code, 3);
}

TEST_F(CommandLine, HelpAndVersionGoToStdout) {
    EXPECT_EQ(marrow_with({"--version"}).out, "marrow " MARROW_VERSION "\n");
    const Outcome help = marrow_with({"--help"});
    EXPECT_EQ(help.code, 0);
    EXPECT_NE(help.out.find("bone >= 226"), help.out.npos);
    EXPECT_NE(help.out.find("not a medical device"), help.out.npos);
}

// Scans that are not part of the repository.
class CommandLineOnScans : public Test {
  protected:
    void SetUp() override {
        const char* data = std::getenv("MARROW_TEST_DATA");
        if (!data) GTEST_SKIP() << "MARROW_TEST_DATA is not set";
        scans = data;
    }
    std::string scan(const std::string& name) {
        if (!std::filesystem::exists(scans / name)) return {};
        return scans / name;
    }
    std::filesystem::path scans;
    const TemporaryFolder folder;
};

TEST_F(CommandLineOnScans, PresetsFitCtOnly) {
    const std::string ct = scan("slicer_cthead_dcm"), mr = scan("knee_t2_2echo_bigendian");
    if (ct.empty() || mr.empty()) GTEST_SKIP() << "the scans are not there";
    const Outcome head = marrow_with({ct, "-o", folder / "head.stl", "--type", "bone", "--json"});
    EXPECT_EQ(head.code, 0) << head.err;
    EXPECT_EQ(Json::parse(head.out)["input"]["modality"], "CT");

    const Json series = Json::parse(marrow_with({"info", mr, "--json"}).out)["series"];
    ASSERT_EQ(series.size(), 1u);
    EXPECT_EQ(series[0]["volumes"].size(), 2u);
    const Outcome several = marrow_with({mr, "-o", folder / "knee.stl", "--isovalue", "otsu"});
    EXPECT_EQ(several.code, 4) << several.err;
    const Outcome preset = marrow_with({mr, "--volume", "0", "-o", folder / "knee.stl", "--type", "bone"});
    EXPECT_EQ(preset.code, 2) << preset.err;
    EXPECT_NE(preset.err.find("--isovalue otsu"), preset.err.npos) << preset.err;
    EXPECT_EQ(folder.files(), Names{"head.stl"});
    const Outcome otsu = marrow_with({mr, "--volume", "0", "-o", folder / "knee.stl", "--isovalue", "otsu"});
    EXPECT_EQ(otsu.code, 0) << otsu.err;
}

}  // namespace
}  // namespace marrow::test
