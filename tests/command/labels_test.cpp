// `marrow INPUT --labels` on the command line.
#include <algorithm>
#include <array>
#include <random>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "support/command_line.h"
#include "support/dicom_objects.h"

namespace marrow::test {
namespace {

using Json = nlohmann::json;
using Names = std::set<std::string>;

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
    EXPECT_NE(file.find("\"name\":\"liver\",\"pbrMetallicRoughness\":{\"baseColorFactor\":[1.0,0.0,0.0,1]"),
              file.npos);
}

// Segments 1 and 2 overlap, so that they are in different label maps. --labels is not necessary.
TEST(Segmentation, BecomesOneFileOfItsSegments) {
    const TemporaryFolder folder;
    segmentation({{1, 0, {1, 1, 0, 1, 1, 0}}, {2, 0, {0, 1, 1, 0, 1, 1}}, {2, 0.25, {0, 1, 1, 0, 1, 1}}},
                 "BINARY")
        .write(folder / "seg.dcm");
    const Outcome outcome =
        marrow_with({folder / "seg.dcm", "-o", folder / "parts.glb", "--relax", "0", "--json", "--verify"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const Json surfaces = Json::parse(outcome.out)["surfaces"];
    ASSERT_EQ(surfaces.size(), 2u);
    EXPECT_EQ(surfaces[0]["name"], "liver");
    EXPECT_EQ(surfaces[0]["samples"], 4);
    EXPECT_EQ(surfaces[1]["name"], "left kidney");
    EXPECT_EQ(surfaces[1]["samples"], 8);
    EXPECT_EQ(marrow_with({folder / "seg.dcm", "-o", folder / "one.stl", "--only", "left kidney"}).code, 0);
    // A table takes the place of what it has.
    write_file(folder / "table", "1 \"spleen\x1b\"\n");
    const Outcome named =
        marrow_with({folder / "seg.dcm", "--labels", folder / "table", "-o", folder / "named.glb"});
    EXPECT_NE(named.out.find("of label 1, spleen\\x1b: "), named.out.npos) << named.out;
    EXPECT_NE(named.out.find("of label 2, left kidney: "), named.out.npos) << named.out;
    const std::string of_folder = folder / "of_folder.glb";
    ASSERT_EQ(marrow_with({folder.path(), "-o", of_folder, "--relax", "0"}).code, 0);
    EXPECT_EQ(read_file(of_folder), read_file(folder / "parts.glb"));
    const Outcome info = marrow_with({"info", folder / "seg.dcm"});
    EXPECT_EQ(info.err, "");
    EXPECT_NE(info.out.find("volume 1         segments 2"), info.out.npos) << info.out;
    EXPECT_NE(info.out.find("1 liver (4 samples), 2 left kidney (8 samples)"), info.out.npos) << info.out;
    // The same beside another series.
    write_series(folder, 3, "scan/s");
    std::filesystem::copy(folder / "seg.dcm", folder / "scan" / "seg.dcm");
    const Outcome beside = marrow_with({"info", folder / "scan" / "seg.dcm", "--json"});
    const Json report = Json::parse(beside.out);
    EXPECT_TRUE(report.at("refused").is_null()) << beside.out;
    EXPECT_EQ(report["values"]["labels"], Json::parse(R"([{"label": 1, "name": "liver", "samples": 4},
                              {"label": 2, "name": "left kidney", "samples": 8}])"));
    const Outcome both = marrow_with({"info", (folder / "scan").string(), "--json"});
    for (const Json& series : Json::parse(both.out).at("series"))
        EXPECT_TRUE(series.at("refused").is_null()) << both.out;
    const Outcome open_choice =
        marrow_with({(folder / "scan").string(), "-o", folder / "c.glb", "--only", "liver"});
    EXPECT_EQ(open_choice.code, kGeometry);
    EXPECT_NE(open_choice.err.find("there are 2 series"), open_choice.err.npos) << open_choice.err;
    EXPECT_EQ(marrow_with({folder / "seg.dcm", "-o", folder / "b.stl", "--volume", "2"}).code, 2);
    EXPECT_NE(marrow_with({folder / "seg.dcm", "-o", folder / "b.stl", "--snap", "0.3"})
                  .err.find("--snap does not go with --labels or a segmentation"),
              std::string::npos);
}

TEST_F(LabelMap, Of3DSlicerNeedsNoOptionAndHasNames) {
    std::string file = read_file(map);
    file.insert(
        file.find("\n\n") + 1,
        "Segment0_LabelValue:=7\nSegment0_Name:=left kidney\nSegment1_LabelValue:=3\nSegment1_Name:=liver\n");
    write_file(folder / "map.seg.nrrd", file);
    const Outcome outcome = marrow_with({folder / "map.seg.nrrd", "-o", folder / "all.glb", "--json"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const Json surfaces = Json::parse(outcome.out)["surfaces"];
    ASSERT_EQ(surfaces.size(), 3u);
    EXPECT_EQ(surfaces[0]["name"], "liver");
    EXPECT_EQ(surfaces[1]["name"], "left kidney");
    EXPECT_EQ(surfaces[2]["name"], "label-12");
    const Outcome info = marrow_with({"info", folder / "map.seg.nrrd"});
    EXPECT_NE(info.out.find("7 left kidney ("), info.out.npos) << info.out;
}

// Each layer numbers its labels from 1, so two segments have label 1.
TEST_F(LabelMap, Of3DSlicerMayHaveSegmentsThatOverlap) {
    const std::size_t side = 6;
    std::string data;
    for (std::size_t i = 0; i < side * side * side; ++i) {
        const std::array at = {i % side, i / side % side, i / side / side};
        const auto within = [&](std::size_t first, std::size_t last) {
            return std::all_of(at.begin(), at.end(), [&](std::size_t c) { return c >= first && c <= last; });
        };
        data += within(1, 4) ? '\1' : '\0';
        data += within(2, 3) ? '\1' : '\0';
    }
    const std::string layers = folder / "layers.seg.nrrd";
    write_file(layers,
               "NRRD0004\ntype: uchar\ndimension: 4\nsizes: 2 6 6 6\nencoding: raw\n"
               "space: left-posterior-superior\nspace directions: none (1,0,0) (0,1,0) (0,0,1)\n"
               "kinds: list domain domain domain\n"
               "Segment0_LabelValue:=1\nSegment0_Name:=liver\nSegment0_Layer:=0\n"
               "Segment1_LabelValue:=1\nSegment1_Name:=tumour\nSegment1_Layer:=1\n\n" +
                   data);
    const Outcome outcome = marrow_with({layers, "-o", folder / "{name}.stl", "--json"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const Json surfaces = Json::parse(outcome.out)["surfaces"];
    ASSERT_EQ(surfaces.size(), 2u);
    EXPECT_EQ(surfaces[0]["name"], "liver");
    EXPECT_EQ(surfaces[0]["samples"], 64);
    EXPECT_EQ(surfaces[1]["name"], "tumour");
    EXPECT_EQ(surfaces[1]["label"], 1);
    EXPECT_EQ(surfaces[1]["samples"], 8);
    EXPECT_GT(read_file(folder / "liver.stl").size(), read_file(folder / "tumour.stl").size());
    // A label's number means both.
    EXPECT_EQ(marrow_with({layers, "-o", folder / "{name}.ply", "--only", "1"}).code, 0);
    EXPECT_EQ(marrow_with({layers, "-o", folder / "one.obj", "--only", "tumour"}).code, 0);
    EXPECT_EQ(marrow_with({layers, "-o", folder / "same.obj", "--volume", "1"}).code, 0);
    EXPECT_EQ(folder.files(), (Names{"map.nrrd", "table.ctbl", "layers.seg.nrrd", "liver.stl", "tumour.stl",
                                     "liver.ply", "tumour.ply", "one.obj", "same.obj"}));
    EXPECT_EQ(read_file(folder / "one.obj"), read_file(folder / "same.obj"));
    const Outcome info = marrow_with({"info", layers});
    EXPECT_EQ(info.code, 0) << info.err;
    EXPECT_NE(info.out.find("volume 1         segments tumour"), info.out.npos) << info.out;
    EXPECT_NE(info.out.find("1 liver (64 samples), 1 tumour (8 samples)"), info.out.npos) << info.out;
}

TEST_F(LabelMap, BecomesAFileForEachLabel) {
    EXPECT_EQ(marrow_with({map, "--labels", table, "-o", folder / "part {name}.stl"}).code, 0);
    EXPECT_EQ(folder.files(),
              (Names{"map.nrrd", "table.ctbl", "part liver.stl", "part a_b.stl", "part label-12.stl"}));
}

TEST_F(LabelMap, DistinguishesLabelsOfTheSameName) {
    write_file(table, "3 part\n7 part\n");
    EXPECT_EQ(marrow_with({map, "--labels", table, "-o", folder / "{name}.stl"}).code, 0);
    EXPECT_EQ(folder.files(), (Names{"map.nrrd", "table.ctbl", "part-3.stl", "part-7.stl", "label-12.stl"}));
}

TEST_F(LabelMap, NumbersNamesUntilTheyAreUnique) {
    write_file(table, "3 part\n7 part\n12 part-7\n");
    const Outcome outcome = marrow_with({map, "--labels", table, "-o", folder / "{name}.stl"});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(folder.files(), (Names{"map.nrrd", "table.ctbl", "part-3.stl", "part-7-7.stl", "part-7.stl"}));
}

TEST_F(LabelMap, RelaxationIsOptional) {
    const auto first_surface = [&](const std::string& passes) {
        const Outcome outcome =
            marrow_with({map, "-o", folder / "a.glb", "--labels", "--relax", passes, "--json"});
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        return Json::parse(outcome.out)["surfaces"][0];
    };
    const Json raw = first_surface("0");
    EXPECT_NE(raw["volume_mm3"], first_surface("40")["volume_mm3"]);
    EXPECT_EQ(raw["held_back"], 0);
}

TEST_F(LabelMap, WarnsOfSurfacesThatShrink) {
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

TEST_F(LabelMap, WithOneLabelFitsAnyFormat) {
    write_nrrd(map, 6, 6, 6, [](int x, int y, int z) {
        return 4 * (std::min({x, y, z, 5 - x, 5 - y, 5 - z}) > 0);
    });
    EXPECT_EQ(marrow_with({map, "--labels", "-o", folder / "one.stl"}).code, 0);
    EXPECT_EQ(folder.files(), (Names{"map.nrrd", "table.ctbl", "one.stl"}));
}

TEST_F(LabelMap, WithSeveralLabelsIsRefusedBeforeTheyAreExtracted) {
    const Outcome outcome = marrow_with({map, "--labels", "-o", folder / "one.stl", "--verbose"});
    EXPECT_EQ(outcome.code, kUsage);
    EXPECT_NE(outcome.err.find("can hold only one surface"), outcome.err.npos) << outcome.err;
    EXPECT_EQ(outcome.err.find("extract"), outcome.err.npos) << outcome.err;
}

TEST_F(LabelMap, WritesOnlyTheWantedLabelsInTheSameShape) {
    const auto surfaces = [&](const std::vector<std::string>& more) {
        std::vector<std::string> command{map, "--labels", table, "-o", folder / "a.vtp", "--json"};
        command.insert(command.end(), more.begin(), more.end());
        const Outcome outcome = marrow_with(command);
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        return Json::parse(outcome.out)["surfaces"];
    };
    const Json all = surfaces({}), two = surfaces({"--only", "LIVER,12"});
    ASSERT_EQ(two.size(), 2u);
    EXPECT_EQ(two[0], all[0]);
    EXPECT_EQ(two[1], all[2]);
    EXPECT_EQ(marrow_with({map, "--labels", table, "-o", folder / "b.stl", "--only", "7"}).code, 0);
    // The table belongs to the map, even if it has no wanted label.
    EXPECT_EQ(marrow_with({map, "--labels", table, "-o", folder / "c.vtp", "--only", "12", "-q"}).err, "");
    write_file(table, "3,\"lobe, left\"\n7 lobe\n");
    EXPECT_EQ(marrow_with({map, "--labels", table, "-o", folder / "d.stl", "--only", "lobe, left"}).code, 0);
    EXPECT_EQ(surfaces({"--only", "3, 12"}).size(), 2u);
    EXPECT_EQ(surfaces({"--only", " 3,"}).size(), 1u);
    EXPECT_EQ(marrow_with({map, "--labels", table, "-o", folder / "c.vtp", "--only", ","}).code, kUsage);
    const Outcome missing = marrow_with({map, "--labels", table, "-o", folder / "c.vtp", "--only", "7,5"});
    EXPECT_EQ(missing.code, kUsage);
    EXPECT_NE(missing.err.find("has no label '5'"), missing.err.npos) << missing.err;
    write_file(table, "3 \"7\"\n7 tail\n");
    const Json number = surfaces({"--only", "7"});
    ASSERT_EQ(number.size(), 1u);
    EXPECT_EQ(number[0]["label"], 7);
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

TEST_F(LabelMap, WarnsOfTablesForAnotherMap) {
    write_file(table, "99 elsewhere\n");
    EXPECT_NE(marrow_with({map, "--labels", table, "-o", folder / "a.vtp"})
                  .err.find("has none of the map's labels"),
              std::string::npos);
}

// The thousands of surfaces of a scan are refused, unless some are named.
TEST_F(LabelMap, RefusesScans) {
    for (const int lowest : {-1000, 0}) {
        write_nrrd(map, 20, 20, 20, [&](int x, int y, int z) { return 20 * (20 * x + y) + z + lowest; });
        const Outcome outcome = marrow_with({map, "--labels", "-o", folder / "a.vtp"});
        EXPECT_EQ(outcome.code, kUsage);
        EXPECT_NE(outcome.err.find("looks like a scan, not like a label map: it has 8000 different values"),
                  outcome.err.npos)
            << outcome.err;
    }
    EXPECT_EQ(marrow_with({map, "--labels", "--only", "7", "-o", folder / "a.vtp"}).code, kOk);
}

TEST_F(LabelMap, AcceptsManyLabelsAndNegativeOnes) {
    write_nrrd(map, 40, 8, 8, [](int x, int y, int z) { return x / 4 + 10 * (y / 4) + 20 * (z / 4) - 2; });
    const Outcome outcome = marrow_with({map, "--labels", "-o", folder / "a.vtp", "--json"});
    ASSERT_EQ(outcome.code, kOk) << outcome.err;
    EXPECT_EQ(Json::parse(outcome.out)["surfaces"].size(), 39u);
    // A scan that is clipped.
    std::mt19937 random(5);
    write_nrrd(map, 20, 20, 20,
               [&](int x, int, int) { return x < 14 ? -1000 : static_cast<int>(random() % 2000) - 900; });
    EXPECT_EQ(marrow_with({map, "--labels", "-o", folder / "a.vtp"}).code, kUsage);
}

TEST_F(LabelMap, NamesTheLabelsThatThereAre) {
    write_file(table, "3 kidney\n7 liver\n");
    const auto err = [&](const char* only) {
        return marrow_with({map, "--labels", table, "-o", folder / "a.vtp", "--only", only}).err;
    };
    EXPECT_NE(err("kidny").find("has no label 'kidny': did you mean kidney?"), std::string::npos)
        << err("kidny");
    EXPECT_NE(err("heart").find("has no label 'heart': it has 3 kidney, 7 liver"), std::string::npos)
        << err("heart");
}

// In noise, the surface of a label touches itself at points, which STL merges.
TEST_F(LabelMap, WarnsOfPointsThatStlJoins) {
    const auto warns = [&](const char* file) {
        return marrow_with({map, "--labels", "-o", folder / file}).err.find("have the same coordinates") !=
               std::string::npos;
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
    const Outcome swallowed = marrow_with({"--labels", map, "-o", folder / "a.glb"});
    EXPECT_EQ(swallowed.code, kUsage);
    EXPECT_NE(swallowed.err.find("after --labels is its table"), swallowed.err.npos) << swallowed.err;
    write_file(table, "nonsense");
    EXPECT_EQ(code({"-o", folder / "a.glb"}), kUnreadable);
    write_nrrd(map, 3, 3, 3, [](int, int, int) { return 0; });
    EXPECT_EQ(marrow_with({map, "--labels", "-o", folder / "a.glb"}).code, kEmpty);
}

}  // namespace
}  // namespace marrow::test
