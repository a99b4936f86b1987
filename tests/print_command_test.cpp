// marrow sweep, label maps and files of several surfaces, as the command line has them.
#include <cstdio>
#include <random>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "command_line.h"

namespace marrow::test {
namespace {

using Json = nlohmann::json;
using Names = std::set<std::string>;

class Sweep : public testing::Test {
  protected:
    void SetUp() override { write_nrrd(scan, 24, 25, 13, ball(12, 12, 6, 8)); }
    const TemporaryFolder folder;
    const std::string scan = folder / "ball.nrrd";
};

TEST_F(Sweep, WritesATableAndAPlot) {
    const Outcome outcome = marrow_with({"sweep", scan, "--from", "-500", "--to", "500", "-n", "11", "-o",
                                         folder / "a.csv", "--plot", folder / "a.svg"});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    std::istringstream table(read_file(folder / "a.csv"));
    std::string line;
    std::getline(table, line);
    EXPECT_EQ(line, "isovalue,volume_mm3,area_mm2,components,triangles,shift_mm,plateau");
    double last_volume = 1e9;
    for (int i = 0; i < 11; ++i) {
        ASSERT_TRUE(std::getline(table, line));
        double isovalue = 0, volume = 0;
        ASSERT_EQ(std::sscanf(line.c_str(), "%lf,%lf", &isovalue, &volume), 2);
        EXPECT_EQ(isovalue, -500 + 100 * i);
        EXPECT_LT(volume, last_volume);
        last_volume = volume;
    }
    EXPECT_FALSE(std::getline(table, line));
    const std::string svg = read_file(folder / "a.svg");
    EXPECT_EQ(svg.find("<svg "), 0u);
    EXPECT_NE(svg.find("</svg>"), svg.npos);
}

TEST_F(Sweep, SaysNoShiftToTheFirst) {
    const std::vector<std::string> command{"sweep", scan, "--from", "0", "--to", "100", "-n", "2"};
    const std::string table = marrow_with(command).out, row = table.substr(table.find('\n') + 1);
    EXPECT_EQ(row.substr(0, row.find('\n')).substr(row.find('\n') - 2), ",,") << row;
    std::vector<std::string> as_json = command;
    as_json.push_back("--json");
    const Json json = Json::parse(marrow_with(as_json).out);
    EXPECT_TRUE(json["sweep"][0]["shift_mm"].is_null());
    EXPECT_GT(json["sweep"][1]["shift_mm"], 0);
}

TEST_F(Sweep, DrawsRoundNumbersInPlain) {
    ASSERT_EQ(marrow_with({"sweep", scan, "--from", "-523", "--to", "891", "-n", "9", "--plot",
                           folder / "a.svg", "-o", folder / "a.csv"})
                  .code,
              0);
    const std::string svg = read_file(folder / "a.svg");
    for (const char* tick : {">-500<", ">0<", ">500<"}) EXPECT_NE(svg.find(tick), svg.npos) << tick;
    for (std::size_t at = svg.find("\">"); at != svg.npos; at = svg.find("\">", at + 1)) {
        const std::string number = svg.substr(at + 2, svg.find('<', at) - at - 2);
        if (number.empty() || number.find_first_not_of("-0123456789.e+") != number.npos) continue;
        EXPECT_EQ(number.find('e'), number.npos) << number;
        std::string digits;  // one that counts, and zeros
        for (const char c : number) digits += c >= '1' && c <= '9' ? std::string(1, c) : "";
        EXPECT_LE(digits.size(), 2u) << number;
    }
}

TEST_F(Sweep, RefusesARangeWithoutASurface) {
    const Outcome above = marrow_with({"sweep", scan, "--from", "5000", "--to", "6000", "-o",
                                       folder / "a.csv", "--plot", folder / "a.svg"});
    EXPECT_EQ(above.code, kEmpty);
    EXPECT_NE(above.err.find("-1000 to 1000"), above.err.npos) << above.err;
    EXPECT_EQ(folder.files(), (Names{"ball.nrrd"}));
}

TEST(SweepOfFloats, WarnsOfSamplesWithoutAValue) {
    const TemporaryFolder folder;
    std::string text =
        "NRRD0005\ntype: float\ndimension: 3\nsizes: 4 4 4\nendian: little\nencoding: raw\n"
        "space directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\nspace: "
        "left-posterior-superior\n\n";
    for (int i = 0; i < 64; ++i) {
        const float sample = i % 9 == 0 ? std::nanf("") : static_cast<float>(i % 7);
        text.append(reinterpret_cast<const char*>(&sample), sizeof sample);
    }
    write_file(folder / "nan.nrrd", text);
    const Outcome outcome = marrow_with({"sweep", folder / "nan.nrrd", "-n", "3"});
    EXPECT_EQ(outcome.code, 0);
    EXPECT_NE(outcome.err.find("8 samples are NaN"), outcome.err.npos) << outcome.err;
}

TEST_F(Sweep, SaysTheNumbersOfTheSurfaceItself) {
    const Outcome outcome = marrow_with({"sweep", scan, "--from", "0", "--to", "100", "-n", "2", "--json"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const Json first = Json::parse(outcome.out)["sweep"][0];
    const Json alone =
        Json::parse(marrow_with({scan, "-o", folder / "a.stl", "--isovalue", "0", "--json"}).out);
    for (const char* name : {"isovalue", "components", "triangles"}) EXPECT_EQ(first[name], alone[name]);
    for (const char* name : {"volume_mm3", "area_mm2"})
        EXPECT_NEAR(first[name].get<double>(), alone[name].get<double>(), 1e-5 * alone[name].get<double>());
}

TEST_F(Sweep, GoesOverAllSamplesWhereItIsNotTold) {
    const Outcome outcome = marrow_with({"sweep", scan, "-n", "3"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(outcome.out.find("\n-1000,"), outcome.out.find('\n'));
    EXPECT_NE(outcome.out.find("\n1000,"), outcome.out.npos);
}

TEST_F(Sweep, RefusesWhatMakesNoSense) {
    for (const std::vector<std::string>& more :
         std::vector<std::vector<std::string>>{{"--from", "5", "--to", "5"},
                                               {"--from", "x"},
                                               {"-n", "1"},
                                               {"-o", "a.txt"},
                                               {"--plot", "a.png"}}) {
        std::vector<std::string> command{"sweep", scan};
        command.insert(command.end(), more.begin(), more.end());
        EXPECT_EQ(marrow_with(command).code, kUsage) << more[0];
    }
    EXPECT_EQ(marrow_with({"sweep", scan}, true).code, kCancelled);
}

TEST_F(Sweep, SeveralSurfacesGoIntoOneFile) {
    const Outcome outcome =
        marrow_with({scan, "-o", folder / "two.glb", "--type", "bone", "--type", "skin", "--json"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(folder.files(), (Names{"ball.nrrd", "two.glb"}));
    const std::string file = read_file(folder / "two.glb");
    EXPECT_NE(file.find("\"name\":\"bone\""), file.npos);
    EXPECT_NE(file.find("\"name\":\"skin\""), file.npos);
    EXPECT_EQ(marrow_with({scan, "-o", folder / "two.stl", "--type", "bone", "--type", "skin"}).code, kUsage);
    EXPECT_EQ(marrow_with({scan, "-o", folder / "a.glb", "--type", "bone", "--space", "RAS"}).code, kUsage);
}

class LabelMap : public testing::Test {
  protected:
    void SetUp() override {
        write_nrrd(map, 12, 6, 5, [](int x, int y, int z) {
            const bool inside = x > 0 && x < 11 && y > 0 && y < 5 && z > 0 && z < 4;
            return !inside ? 0 : x < 6 ? 3 : x < 9 ? 7 : 12;
        });
        write_file(folder / "table.ctbl", "3 liver 255 0 0 255\n7 a/b 0 255 0 255\n");
    }
    const TemporaryFolder folder;
    const std::string map = folder / "map.nrrd";
    const std::string table = folder / "table.ctbl";
};

TEST_F(LabelMap, BecomesOneFileOfNamedSurfaces) {
    const Outcome outcome =
        marrow_with({map, "--labels", table, "-o", folder / "all.glb", "--json", "--verify"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const Json surfaces = Json::parse(outcome.out)["surfaces"];
    ASSERT_EQ(surfaces.size(), 3u);
    EXPECT_EQ(surfaces[0]["label"], 3);
    EXPECT_EQ(surfaces[0]["name"], "liver");
    EXPECT_EQ(surfaces[1]["name"], "a/b");
    EXPECT_EQ(surfaces[2]["name"], "label-12");
    for (const Json& s : surfaces) {
        EXPECT_EQ(s["boundary_edges"], 0);
        EXPECT_EQ(s["nonmanifold_edges"], 0);
        EXPECT_EQ(s["euler_characteristic"], 2);
        EXPECT_GT(s["volume_mm3"], 0);
    }
    const std::string file = read_file(folder / "all.glb");
    EXPECT_NE(file.find("\"name\":\"liver\",\"pbrMetallicRoughness\":{\"baseColorFactor\":[1,0,0,1]"),
              file.npos);
}

TEST_F(LabelMap, BecomesAFileForEachLabel) {
    EXPECT_EQ(marrow_with({map, "--labels", table, "-o", folder / "part {name}.stl"}).code, 0);
    EXPECT_EQ(folder.files(),
              (Names{"map.nrrd", "table.ctbl", "part liver.stl", "part a_b.stl", "part label-12.stl"}));
}

TEST_F(LabelMap, TellsLabelsOfOneNameApart) {
    write_file(table, "3 part\n7 part\n");
    EXPECT_EQ(marrow_with({map, "--labels", table, "-o", folder / "{name}.stl"}).code, 0);
    EXPECT_EQ(folder.files(), (Names{"map.nrrd", "table.ctbl", "part-3.stl", "part-7.stl", "label-12.stl"}));
}

TEST_F(LabelMap, RelaxationCanBeLeftOut) {
    const auto volume = [&](const std::string& passes) {
        const Outcome outcome =
            marrow_with({map, "-o", folder / "a.glb", "--labels", "--relax", passes, "--json"});
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        return Json::parse(outcome.out)["surfaces"][0]["volume_mm3"].get<double>();
    };
    EXPECT_NE(volume("0"), volume("40"));
}

TEST_F(LabelMap, SaysWhatSurfacesLoseOfTheirSamples) {
    const Outcome outcome = marrow_with({map, "--labels", table, "-o", folder / "all.vtp", "--json"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const Json surfaces = Json::parse(outcome.out)["surfaces"];
    const std::int64_t samples[] = {5 * 4 * 3, 3 * 4 * 3, 2 * 4 * 3};
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(surfaces[i]["samples"], samples[i]);
        EXPECT_EQ(surfaces[i]["samples_mm3"], 2 * samples[i]);  // of 1 x 1 x 2 mm
        EXPECT_NEAR(surfaces[i]["volume_mm3"].get<double>() / static_cast<double>(2 * samples[i]), 1, 0.15);
    }
    EXPECT_NE(outcome.err.find(
                  "1 of 3 surfaces enclose at least a tenth less than their samples, label-12 most: -14 %"),
              outcome.err.npos)
        << outcome.err;

    write_nrrd(map, 60, 60, 60, [](int x, int y, int z) {
        return std::min({x, y, z, 59 - x, 59 - y, 59 - z}) > 0;
    });
    EXPECT_EQ(marrow_with({map, "--labels", "-o", folder / "all.vtp", "-q"}).err, "");
}

TEST_F(LabelMap, OfOneLabelGoesIntoAnyFormat) {
    write_nrrd(map, 6, 6, 6, [](int x, int y, int z) {
        return 4 * (std::min({x, y, z, 5 - x, 5 - y, 5 - z}) > 0);
    });
    EXPECT_EQ(marrow_with({map, "--labels", "-o", folder / "one.stl"}).code, 0);
    EXPECT_EQ(folder.files(), (Names{"map.nrrd", "table.ctbl", "one.stl"}));
}

TEST_F(LabelMap, GivesOnlyTheLabelsAskedForInTheSameShape) {
    const auto surfaces = [&](const std::vector<std::string>& more) {
        std::vector<std::string> command{map, "--labels", table, "-o", folder / "a.vtp", "--json"};
        command.insert(command.end(), more.begin(), more.end());
        const Outcome outcome = marrow_with(command);
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        return Json::parse(outcome.out)["surfaces"];
    };
    const Json all = surfaces({}), two = surfaces({"--only", "liver,12"});
    ASSERT_EQ(two.size(), 2u);
    EXPECT_EQ(two[0], all[0]);
    EXPECT_EQ(two[1], all[2]);
    EXPECT_EQ(marrow_with({map, "--labels", table, "-o", folder / "b.stl", "--only", "7"}).code, 0);
    const Outcome missing = marrow_with({map, "--labels", table, "-o", folder / "c.vtp", "--only", "7,5"});
    EXPECT_EQ(missing.code, kUsage);
    EXPECT_NE(missing.err.find("the map has no label '5'"), missing.err.npos) << missing.err;
}

TEST_F(LabelMap, CanBeCropped) {
    const Outcome outcome =
        marrow_with({map, "--labels", table, "-o", folder / "a.vtp", "--crop", "vox:0,7,0,5,0,4", "--json"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const Json surfaces = Json::parse(outcome.out)["surfaces"];
    ASSERT_EQ(surfaces.size(), 2u);
    EXPECT_EQ(surfaces[1]["samples"], 2 * 4 * 3);
}

TEST_F(LabelMap, WritesAllFilesOrNone) {
    std::filesystem::create_directory(folder / "part-label-12.stl");  // where the last would go
    const Outcome outcome = marrow_with({map, "--labels", table, "-o", folder / "part-{name}.stl"});
    EXPECT_EQ(outcome.code, kUnreadable);
    EXPECT_EQ(folder.files(), (Names{"map.nrrd", "table.ctbl", "part-label-12.stl"}));
}

TEST_F(LabelMap, WarnsOfWhatItMayNotBeAndOfATableForAnother) {
    write_file(table, "99 elsewhere\n");
    EXPECT_NE(marrow_with({map, "--labels", table, "-o", folder / "a.vtp"})
                  .err.find("has none of the map's labels"),
              std::string::npos);
    write_nrrd(map, 20, 20, 20, [](int x, int y, int z) { return 20 * (20 * x + y) + z - 1000; });
    EXPECT_NE(marrow_with({map, "--labels", "-o", folder / "a.vtp"})
                  .err.find("is this a scan rather than a label map?"),
              std::string::npos);
}

// Two cubes that touch at an edge of the grid are two pieces, which STL cannot say.
TEST_F(LabelMap, WarnsOfPointsThatStlJoins) {
    const auto warns = [&](const char* file) {
        return marrow_with({map, "--labels", "-o", folder / file, "--relax", "40"})
                   .err.find("lie where others do") != std::string::npos;
    };
    EXPECT_FALSE(warns("{name}.stl"));
    std::mt19937 random(5);
    write_nrrd(map, 16, 16, 16, [&](int, int, int) { return static_cast<int>(random() % 3); });
    EXPECT_TRUE(warns("{name}.stl"));
    EXPECT_FALSE(warns("all.vtp"));
}

TEST_F(LabelMap, RefusesWhatMakesNoSense) {
    const auto code = [&](std::vector<std::string> more) {
        std::vector<std::string> command{map, "--labels", table};
        command.insert(command.end(), more.begin(), more.end());
        return marrow_with(command).code;
    };
    EXPECT_EQ(code({"-o", folder / "a.stl"}), kUsage);
    EXPECT_EQ(code({"-o", folder / "a.glb", "--isovalue", "1"}), kUsage);
    EXPECT_EQ(code({"-o", folder / "a.glb", "--relax", "-1"}), kUsage);
    EXPECT_EQ(code({}), kUsage);
    EXPECT_EQ(marrow_with({map, "-o", folder / "a.glb", "--isovalue", "1", "--relax", "3"}).code, kUsage);
    EXPECT_EQ(marrow_with({map, "--labels", folder / "missing", "-o", folder / "a.glb"}).code, kUnreadable);
    write_file(table, "nonsense");
    EXPECT_EQ(code({"-o", folder / "a.glb"}), kUnreadable);
    write_nrrd(map, 3, 3, 3, [](int, int, int) { return 0; });
    EXPECT_EQ(marrow_with({map, "--labels", "-o", folder / "a.glb"}).code, kEmpty);
}

}  // namespace
}  // namespace marrow::test
