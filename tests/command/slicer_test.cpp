// PrusaSlicer slices the written meshes without repairing them. Skipped if it is not installed.
#include <cstdlib>

#include <gtest/gtest.h>

#include "cranium.h"
#include "support/command_line.h"

namespace marrow::test {
namespace {

class Slicer : public testing::Test {
  protected:
    void SetUp() override {
        if (std::system("command -v prusa-slicer > /dev/null 2>&1") != 0)
            GTEST_SKIP() << "prusa-slicer is not installed (Debian: prusa-slicer)";
    }

    // Captures standard output and errors.
    std::string slicer(const std::string& arguments) const {
        const std::string output = folder / "said";
        const std::string command =
            "HOME='" + folder.path().string() + "' prusa-slicer " + arguments + " > '" + output + "' 2>&1";
        EXPECT_EQ(std::system(command.c_str()), 0) << read_file(output);
        return read_file(output);
    }

    void expect_sliced(const std::string& mesh, const std::string& options) const {
        const std::string info = slicer("--info '" + mesh + "'");
        EXPECT_NE(info.find("manifold = yes"), info.npos) << info;
        for (const char* repair : {"facets_removed", "degenerate_facets", "edges_fixed", "facets_reversed",
                                   "backwards_edges", "open_edges", "manifold = no"})
            EXPECT_EQ(info.find(repair), info.npos) << info;
        const std::string code = folder / "sliced.gcode";
        const std::string said = slicer("--export-gcode --center 100,100 --layer-height 0.3 " + options +
                                        " '" + mesh + "' -o '" + code + "'");
        EXPECT_NE(said.find("Slicing result exported"), said.npos) << said;
        EXPECT_GT(std::filesystem::file_size(code), 10000u);
    }

    void expect_skull_sliced(const std::string& scan) const {
        for (const char* name : {"skull.stl", "skull.3mf"}) {
            const std::string mesh = folder / name;
            // No integer sample of a CT equals this isovalue, so every triangle has an area.
            const Outcome outcome = marrow_with({scan, "-o", mesh, "--isovalue", "225.5", "--largest"});
            ASSERT_EQ(outcome.code, 0) << outcome.err;
            expect_sliced(mesh, "--scale 0.1");
        }
    }

    const TemporaryFolder folder;
};

TEST_F(Slicer, TakesABallInStlAnd3mf) {
    const std::string scan = folder / "ball.nrrd";
    write_nrrd(scan, 40, 40, 22, ball(19.3, 19.7, 10.4, 16.2));
    for (const char* name : {"ball.stl", "ball.3mf"}) {
        const std::string mesh = folder / name;
        ASSERT_EQ(marrow_with({scan, "-o", mesh, "--isovalue", "0.5"}).code, 0);
        expect_sliced(mesh, "");
    }
}

TEST_F(Slicer, TakesTheSkullOfCraniumInStlAnd3mf) {
    const std::optional<Volume> cranium = bench::cranium();
    if (!cranium) GTEST_SKIP() << "Cranium is not there (Debian: invesalius-examples)";
    const std::string scan = folder / "cranium.nrrd";
    write_nrrd(scan, 256, 256, 108, [&](int x, int y, int z) {
        return cranium->samples<std::int16_t>()[(z * 256 + y) * 256 + x];
    });
    expect_skull_sliced(scan);
}

TEST_F(Slicer, TakesTheSkullOfTheVisibleHumanInStlAnd3mf) {
    const char* data = std::getenv("MARROW_TEST_DATA");
    if (data == nullptr) GTEST_SKIP() << "MARROW_TEST_DATA names no folder with vhf_head_ct";
    const std::filesystem::path scan = std::filesystem::path(data) / "vhf_head_ct";
    if (!std::filesystem::exists(scan)) GTEST_SKIP() << scan << " is not there";
    expect_skull_sliced(scan);
}

}  // namespace
}  // namespace marrow::test
