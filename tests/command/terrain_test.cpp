// `marrow terrain` on the command line.
#include <gtest/gtest.h>

#include <sys/resource.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include <marrow/mesh_io.h>

#include "commands/terrain.h"
#include "support/temporary_folder.h"

namespace marrow::test {
namespace {

using namespace marrow::apps;

struct Outcome {
    int code;
    std::string out;
    std::string err;
};

Outcome terrain_with(const std::vector<std::string>& arguments, bool stop = false) {
    std::vector<const char*> argv{"marrow terrain"};
    for (const std::string& argument : arguments) argv.push_back(argument.c_str());
    std::ostringstream out, err;
    const std::atomic<bool> stopped{stop};
    const int code = run_terrain(static_cast<int>(argv.size()), argv.data(), {out, err}, stopped);
    return {code, out.str(), err.str()};
}

/// An Arc/Info ASCII grid: a tent, 100 m high, on 65 x 49 samples of 5 m.
std::filesystem::path write_grid(const std::filesystem::path& file) {
    std::ostringstream text;
    text << "ncols 65\nnrows 49\nxllcorner 1000\nyllcorner 2000\ncellsize 5\nNODATA_value -9999\n";
    for (int row = 0; row < 49; ++row) {
        for (int column = 0; column < 65; ++column)
            text << 100 - std::max(std::abs(column - 32) * 3, std::abs(row - 24) * 4) << ' ';
        text << '\n';
    }
    write_file(file, text.str());
    return file;
}

TEST(TerrainCommand, WritesABlockAndSaysWhatItIs) {
    const TemporaryFolder folder;
    const std::string grid = write_grid(folder / "tent.asc");
    const Outcome outcome = terrain_with({grid, "-o", folder / "block.stl", "--base", "4", "--json"});
    ASSERT_EQ(outcome.code, kOk) << outcome.err;
    const auto json = nlohmann::json::parse(outcome.out);
    EXPECT_EQ(json["input"]["format"], "AAIGrid");
    EXPECT_EQ(json["input"]["heights_m"], (std::vector<double>{4, 100}));
    EXPECT_EQ(json["input"]["centre_m"], (std::vector<double>{1162.5, 2122.5}));
    ASSERT_EQ(json["levels"].size(), 1u);
    const auto& level = json["levels"][0];
    EXPECT_EQ(level["boundary_edges"], 0);
    EXPECT_EQ(level["euler_characteristic"], 2);
    EXPECT_EQ(level["bounds_mm"][1][0], 75) << "150 mm wide where nothing else is said";
    EXPECT_NEAR(level["bounds_mm"][1][2].get<double>(), 4 + 96 * 150.0 / 320, 1e-4);
    EXPECT_LT(level["height_error"]["rms_of_cell"].get<double>(), 1e-5);
    EXPECT_EQ(json["warnings"].size(), 1u) << "the grid names no coordinates";
    EXPECT_EQ(std::filesystem::file_size(folder / "block.stl"),
              84 + 50 * level["triangles"].get<std::size_t>());
}

TEST(TerrainCommand, WritesLevelsWithHalfTheResolutionEach) {
    const TemporaryFolder folder;
    const std::string grid = write_grid(folder / "tent.asc");
    EXPECT_EQ(terrain_with({grid, "-o", folder / "levels/", "--levels", "3"}).code, kUnreadable);
    std::filesystem::create_directory(folder / "levels");
    const Outcome outcome = terrain_with({grid, "-o", folder / "levels/", "--levels", "3", "--json"});
    ASSERT_EQ(outcome.code, kOk) << outcome.err;
    const auto levels = nlohmann::json::parse(outcome.out)["levels"];
    ASSERT_EQ(levels.size(), 3u);
    EXPECT_TRUE(levels[0]["volume_mm3"].is_null()) << "it is open";
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(levels[i]["cell_m"][2], 5 << i);
        EXPECT_EQ(levels[i]["output"], (folder / ("levels/level" + std::to_string(i) + ".stl")).string());
        EXPECT_TRUE(std::filesystem::exists(levels[i]["output"].get<std::string>()));
        if (i > 0) {
            EXPECT_LT(levels[i]["triangles"], 0.3 * levels[i - 1]["triangles"].get<double>());
        }
    }
    EXPECT_EQ(terrain_with({grid, "-o", folder / "all.GLB", "--levels", "2"}).code, kOk);
    const std::string only = folder / ("levels/" + std::filesystem::path(grid).stem().string() + ".stl");
    EXPECT_EQ(terrain_with({grid, "-o", folder / "levels"}).code, kOk);
    EXPECT_TRUE(std::filesystem::exists(only)) << "a single surface has the name of the raster";
    const Outcome blocks =
        terrain_with({grid, "-o", folder / "{name}.ply", "--levels", "2", "--base", "4", "--json"});
    EXPECT_EQ(blocks.code, kOk);
    EXPECT_TRUE(std::filesystem::exists(folder / "level1.ply"));
    for (const auto& level : nlohmann::json::parse(blocks.out)["levels"]) {
        EXPECT_EQ(level["mm_per_metre"], 150.0 / 320) << "of level0";
        EXPECT_NEAR(level["origin_m"][2].get<double>(), 4 - 4 * 320 / 150.0, 1e-9) << "its bottom";
    }
}

TEST(TerrainCommand, WritesLevelsAsNodesOfOneScene) {
    const TemporaryFolder folder;
    const std::string grid = write_grid(folder / "tent.asc");
    const Outcome outcome = terrain_with({grid, "-o", folder / "levels.glb", "--levels", "3", "--json"});
    ASSERT_EQ(outcome.code, kOk) << outcome.err;
    const auto levels = nlohmann::json::parse(outcome.out)["levels"];
    const std::string glb = read_file(folder / "levels.glb");
    ASSERT_EQ(glb.substr(0, 4), "glTF");
    std::uint32_t bytes;
    std::memcpy(&bytes, glb.data() + 12, sizeof bytes);
    const auto scene = nlohmann::json::parse(glb.substr(20, bytes));
    ASSERT_EQ(scene["nodes"].size(), 3u);
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(levels[i]["origin_m"], (std::vector<double>{1162.5, 2122.5, 0}));
        EXPECT_EQ(scene["nodes"][i]["name"], "level" + std::to_string(i));
        const auto& mesh = scene["meshes"][scene["nodes"][i]["mesh"].get<std::size_t>()];
        const auto& indices = scene["accessors"][mesh["primitives"][0]["indices"].get<std::size_t>()];
        EXPECT_EQ(indices["count"], 3 * levels[i]["triangles"].get<std::size_t>());
    }
}

TEST(TerrainCommand, FilesClaimNoPatientSpace) {
    const TemporaryFolder folder;
    const std::string grid = write_grid(folder / "tent.asc");
    for (const char* ending : {"stl", "ply", "obj", "vtp"}) {
        const auto file = folder / (std::string("tent.") + ending);
        ASSERT_EQ(terrain_with({grid, "-o", file}).code, kOk);
        const std::string head = read_file(file).substr(0, 2000);
        EXPECT_EQ(head.find("SPACE"), head.npos) << ending;
        EXPECT_EQ(head.find("LPS"), head.npos) << ending;
    }
    for (const char* ending : {"stl", "ply", "obj", "vtp", "3mf", "glb"}) {
        const auto file = folder / (std::string("tent.") + ending);
        ASSERT_EQ(terrain_with({grid, "-o", file}).code, kOk);
        Space space = Space::LPS;
        read_mesh(file, &space);
        EXPECT_EQ(space, Space::none) << ending;
    }
}

TEST(TerrainCommand, RefusesWhatMakesNoSense) {
    const TemporaryFolder folder;
    const std::string grid = write_grid(folder / "tent.asc"), out = folder / "x.stl";
    EXPECT_EQ(terrain_with({}).code, kUsage);
    EXPECT_EQ(terrain_with({grid}).code, kUsage);
    EXPECT_EQ(terrain_with({grid, "-o", folder / "x.doc"}).code, kUsage);
    EXPECT_EQ(terrain_with({grid, "-o", out, "--levels", "2"}).code, kUsage) << "two levels, one file";
    EXPECT_EQ(terrain_with({grid, "-o", out, "--levels", "0"}).code, kUsage);
    EXPECT_EQ(terrain_with({grid, "-o", out, "--picture", "x.jpg"}).code, kUsage);
    for (const char* option : {"--base", "--size", "--exaggerate", "--cell"}) {
        for (const char* value : {"0", "-1", "nan", "x"})
            EXPECT_EQ(terrain_with({grid, "-o", out, option, value}).code, kUsage) << option << ' ' << value;
    }
    EXPECT_EQ(terrain_with({folder / "missing.tif", "-o", out}).code, kUnreadable);
    EXPECT_EQ(terrain_with({grid, "-o", out}, true).code, kCancelled);
    EXPECT_EQ(folder.files(), (std::set<std::string>{"tent.asc"}));
}

TEST(TerrainCommand, RefusesAnEmptySurface) {
    const TemporaryFolder folder;
    const std::string grid = folder / "one.asc";
    const std::string head = "ncols 4\nnrows 4\nxllcorner 0\nyllcorner 0\ncellsize 10\nNODATA_value -9\n";
    write_file(grid, head + "-9 -9 -9 -9\n-9 5 -9 -9\n-9 -9 6 7\n-9 -9 -9 -9\n");
    const Outcome none = terrain_with({grid, "-o", folder / "one.stl"});
    EXPECT_EQ(none.code, kEmpty);
    EXPECT_NE(none.err.find("no surface"), none.err.npos) << none.err;
    EXPECT_EQ(terrain_with({grid, "-o", folder / "block.stl", "--base", "3"}).code, kOk)
        << "a block has walls";
    std::filesystem::remove(folder / "block.stl");
    // The first level has a surface but the second has none: nothing is written or reported.
    write_file(grid, head + "5 6 -9 -9\n5 6 -9 -9\n-9 -9 -9 -9\n-9 -9 -9 -9\n");
    const Outcome second = terrain_with({grid, "-o", folder / "{name}.stl", "--levels", "2"});
    EXPECT_EQ(second.code, kEmpty);
    EXPECT_NE(second.err.find("level1"), second.err.npos) << second.err;
    EXPECT_EQ(second.out, "");
    EXPECT_EQ(folder.files(), (std::set<std::string>{"one.asc"}));
}

TEST(TerrainCommand, CountsLevelsBeforeTheWork) {
    const TemporaryFolder folder;
    const std::string grid = write_grid(folder / "tent.asc");
    const Outcome many = terrain_with({grid, "-o", folder / "{name}.stl", "--levels", "10"});
    EXPECT_EQ(many.code, kUsage);
    EXPECT_NE(many.err.find("level6"), many.err.npos) << many.err;  // 65 x 49, ..., 2 x 2
    EXPECT_NE(many.err.find("at most 6"), many.err.npos) << many.err;
    EXPECT_EQ(folder.files(), (std::set<std::string>{"tent.asc"}));
    EXPECT_EQ(terrain_with({grid, "-o", folder / "{name}.stl", "--levels", "6"}).code, kOk);
    // 49 rows at 5 m are 2.5 cells of 98 m, which give 3 rows; but 1.25 of 196 m give only 1.
    EXPECT_EQ(terrain_with({grid, "-o", folder / "{name}.stl", "--cell", "98", "--levels", "2"}).code,
              kUsage);
}

TEST(TerrainCommand, RefusesAbsurdGridsAtOnce) {
    const TemporaryFolder folder;
    const std::string grid = write_grid(folder / "tent.asc"), out = folder / "x.stl";
    const Outcome fine = terrain_with({grid, "-o", out, "--cell", "0.00001"});  // 10^15 samples
    EXPECT_EQ(fine.code, kUnreadable);
    EXPECT_NE(fine.err.find("larger --cell"), fine.err.npos) << fine.err;
    const Outcome coarse = terrain_with({grid, "-o", out, "--cell", "1e6"});
    EXPECT_EQ(coarse.code, kUsage);
    EXPECT_NE(coarse.err.find("tent.asc': with "), coarse.err.npos) << coarse.err;
    EXPECT_NE(coarse.err.find("give a smaller --cell; the raster's own is 5 m"), coarse.err.npos)
        << coarse.err;
    const Outcome steep = terrain_with({grid, "-o", out, "--exaggerate", "1e9"});
    EXPECT_EQ(steep.code, kUnreadable);
    EXPECT_NE(steep.err.find("give a larger --cell or a smaller --exaggerate"), steep.err.npos) << steep.err;
    EXPECT_EQ(terrain_with({grid, "-o", out, "--base", "1e9"}).code, kUsage);
    EXPECT_EQ(terrain_with({grid, "-o", out, "--base", "101", "--size", "10"}).code, kUsage);
    EXPECT_EQ(folder.files(), (std::set<std::string>{"tent.asc"}));
}

TEST(TerrainCommand, SaysThatUnnamedCoordinatesMayBeDegrees) {
    const TemporaryFolder folder;
    const std::string grid = folder / "deg.asc";
    std::string text =
        "ncols 9\nnrows 9\nxllcorner 11\nyllcorner 47\ncellsize 0.000833333\nNODATA_value -9999\n";
    for (int i = 0; i < 81; ++i) text += std::to_string(500 + 10 * i) + " ";
    write_file(grid, text);
    const Outcome refused = terrain_with({grid, "-o", folder / "x.stl"});
    EXPECT_EQ(refused.code, kUnreadable);
    EXPECT_NE(refused.err.find("does not name its coordinate system"), refused.err.npos) << refused.err;
    EXPECT_NE(refused.err.find(".prj"), refused.err.npos) << refused.err;
    EXPECT_EQ(std::count(refused.err.begin(), refused.err.end(), '\n'), 1);
}

TEST(TerrainCommand, MakesTheGroundAsLongAsRequested) {
    // Samples without a height at the border do not count towards the size.
    const TemporaryFolder folder;
    const std::string grid = folder / "island.asc";
    std::string text = "ncols 40\nnrows 20\nxllcorner 0\nyllcorner 0\ncellsize 10\nNODATA_value -9999\n";
    for (int row = 0; row < 20; ++row) {
        for (int column = 0; column < 40; ++column)
            text +=
                column < 3 || column > 30 || (row == 7 && column == 3) ? "-9999 " : std::to_string(row) + " ";
    }
    write_file(grid, text);
    for (const std::vector<std::string>& more :
         std::vector<std::vector<std::string>>{{"--base", "3"},
                                               {"--size", "150"},
                                               {"--size", "150", "--cell", "7"},
                                               {"--base", "3", "--cell", "25"}}) {
        std::vector<std::string> command{grid, "-o", folder / "x.stl", "--json"};
        command.insert(command.end(), more.begin(), more.end());
        const Outcome outcome = terrain_with(command);
        ASSERT_EQ(outcome.code, kOk) << outcome.err;
        const auto bounds = nlohmann::json::parse(outcome.out)["levels"][0]["bounds_mm"];
        EXPECT_NEAR(bounds[1][0].get<double>() - bounds[0][0].get<double>(), 150, 1e-3) << more[0];
    }
}

TEST(TerrainCommand, SaysItsVersionAndAllFormats) {
    const Outcome version = terrain_with({"--version"});
    EXPECT_EQ(version.code, kOk);
    EXPECT_EQ(version.out.rfind("marrow ", 0), 0u) << version.out;
    const Outcome help = terrain_with({"--help"});
    EXPECT_NE(help.out.find(".gz"), help.out.npos);
}

TEST(TerrainCommand, HoldsSlabsOfTheRasterInMemory) {
    // 2^25 samples, of which the first strip of the surface covers all. GDAL averages them at 8 bytes each.
    const TemporaryFolder folder;
    write_file(folder / "flat.hdr",
               "NROWS 4096\nNCOLS 8192\nNBITS 16\nULXMAP 0\nULYMAP 0\nXDIM 10\nYDIM 10\n");
    write_file(folder / "flat.bil", "");
    std::filesystem::resize_file(folder / "flat.bil", 2 * 4096 * 8192);
    const std::string command = std::string("'") + MARROW_PROGRAM + "' terrain '" +
                                (folder / "flat.bil").string() + "' --cell 640 -q -o '" +
                                (folder / "flat.stl").string() + "' 2>/dev/null";
    ASSERT_EQ(std::system(command.c_str()), 0);
    rusage children{};
    getrusage(RUSAGE_CHILDREN, &children);
    EXPECT_LT(children.ru_maxrss / 1024, 800) << "MB";
}

TEST(TerrainCommand, IsReachedThroughMarrow) {
    const TemporaryFolder folder;
    const std::string grid = write_grid(folder / "tent.asc");
    const std::string command = std::string("'") + MARROW_PROGRAM + "' terrain '" + grid + "' -q -o '";
    EXPECT_EQ(std::system((command + (folder / "tent.ply").string() + "'").c_str()), 0);
    EXPECT_TRUE(std::filesystem::exists(folder / "tent.ply"));
    EXPECT_EQ(WEXITSTATUS(std::system((command + "/nowhere/tent.ply' 2>/dev/null").c_str())), kUnreadable);
}

}  // namespace
}  // namespace marrow::test
