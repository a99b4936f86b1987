// Which results of the command have normals of points.
#include <atomic>
#include <sstream>

#include <gtest/gtest.h>

#include "support/command_line.h"
#include "surface_job.h"

namespace marrow::test {
namespace {

TEST(NormalsOfResults, AreInFilesThatHoldThem) {
    const TemporaryFolder folder;
    const std::string scan = folder / "ball.nrrd", labels = folder / "labels.nrrd",
                      mesh = folder / "ball.ply";
    write_nrrd(scan, 24, 25, 13, ball(12, 12, 6, 5));
    write_nrrd(labels, 12, 12, 12,
               [](int x, int y, int z) { return x > 3 && x < 8 && y > 3 && y < 8 && z > 3 && z < 8; });
    const std::vector<std::vector<std::string>> runs{
        {scan, "--isovalue", "0", "-o", mesh},
        {scan, "--isovalue", "0", "--smooth", "2", "--keep", "0.5", "-o", mesh},
        {scan, "--isovalue", "0", "--max-memory", "1G", "-o", mesh},
        {labels, "--labels", "-o", mesh}};
    for (const std::vector<std::string>& run : runs) {
        const Outcome outcome = marrow_with(run);
        ASSERT_EQ(outcome.code, 0) << outcome.err;
        EXPECT_NE(read_file(mesh).substr(0, 500).find("property float nx\n"), std::string::npos) << run[3];
    }
}

TEST(NormalsOfResults, AreWantedByThePictureToo) {
    std::ostringstream out, err;
    const Console console{out, err, false, false};
    const std::atomic<bool> stop = false;
    SurfaceJobOptions options;
    const auto are_wanted = [&](const std::vector<std::filesystem::path>& files) {
        return SurfaceJob(options, console, stop).shows_normals(files);
    };
    EXPECT_FALSE(are_wanted({"a.stl", "b.3mf", "c.dcm", ""}));
    for (const char* file : {"a.ply", "a.obj.gz", "a.vtp", "a.glb"})
        EXPECT_TRUE(are_wanted({"b.stl", file})) << file;
    options.output.picture = "a.png";
    EXPECT_TRUE(are_wanted({"a.stl"}));
    EXPECT_TRUE(are_wanted({}));
}

}  // namespace
}  // namespace marrow::test
