// The viewer on the first device of Vulkan, which is a software device here.
#include <marrow/gpu.h>
#include <marrow/isosurface.h>

#include <QLabel>

#include "support/mesh_checks.h"
#include "support/viewer_window.h"

namespace marrow::test {
namespace {

using namespace marrow::viewer;

class ViewerOnDevice : public ViewerTest {
  protected:
    void SetUp() override {
        ViewerTest::SetUp();
        if (IsSkipped() || HasFatalFailure()) return;
        EXPECT_EQ(device(), "CPU");
        window = std::make_unique<MainWindow>(0);
        window->resize(1200, 800);
        window->show();
        ASSERT_TRUE(QTest::qWaitForWindowExposed(window.get(), kPatience));
    }

    // What the status bar names.
    QString device() const { return window->findChild<QLabel*>("device")->text(); }

    void expect_mesh_of_cpu() {
        const SurfaceParameters& surface = *session().current();
        const auto shape = window->surfaces().exact(surface.id);
        ASSERT_TRUE(shape);
        const Mesh expected =
            extract_isosurface(session().scan()->volume, surface.isovalue, {.closed = true});
        EXPECT_GT(expected.triangles.size(), 100u);
        EXPECT_EQ(mesh_hash(*shape->mesh), mesh_hash(expected));
    }
};

TEST_F(ViewerOnDevice, TheSurfaceFollowsTheIsovalue) {
    write_nrrd(folder / "ball.nrrd", 24, 25, 13, ball(12, 12, 6, 8));
    ASSERT_TRUE(open(folder / "ball.nrrd"));
    EXPECT_TRUE(device().startsWith("llvmpipe")) << device().toStdString();
    expect_mesh_of_cpu();
    for (const double isovalue : {100.5, 300.0}) {
        session().set_isovalue(isovalue);
        ASSERT_TRUE(settle());
        expect_mesh_of_cpu();
    }
    EXPECT_EQ(window->banner(), "");
}

TEST_F(ViewerOnDevice, LargeScansNeedNoPreviewsUnlessSurfacesAreSmoothed) {
    write_nrrd(folder / "plate.nrrd", 1250, 1250, 1,
               [](int x, int y, int) { return std::hypot(x - 600, y - 600) < 50 ? 1000 : -1000; });
    ASSERT_TRUE(open(folder / "plate.nrrd"));
    EXPECT_EQ(window->surfaces().preview_level(), 0);
    expect_mesh_of_cpu();
    session().change("smooth", "", [](Parameters& p) { p.smooth = 3; });
    EXPECT_EQ(window->surfaces().preview_level(), 1);
    ASSERT_TRUE(settle());
    session().change("do not smooth", "", [](Parameters& p) { p.smooth = 0; });
    EXPECT_EQ(window->surfaces().preview_level(), 0);
    ASSERT_TRUE(settle());
    expect_mesh_of_cpu();
}

TEST_F(ViewerOnDevice, TheCpuExtractsWithExactTopology) {
    write_nrrd(folder / "ball.nrrd", 24, 25, 13, ball(12, 12, 6, 8));
    ASSERT_TRUE(open(folder / "ball.nrrd"));
    session().change("exact topology", "", [](Parameters& p) { p.topology = true; });
    ASSERT_TRUE(settle());
    EXPECT_EQ(device(), "CPU");
    EXPECT_EQ(window->banner(), "");
    expect_mesh_of_cpu();  // a ball has no ambiguous cells
    session().change("no exact topology", "", [](Parameters& p) { p.topology = false; });
    ASSERT_TRUE(settle());
    EXPECT_TRUE(device().startsWith("llvmpipe"));
    expect_mesh_of_cpu();
}

TEST_F(ViewerOnDevice, TheCpuTakesOverAndTheWindowSaysSo) {
    std::string text =
        "NRRD0005\ntype: int32\ndimension: 3\nsizes: 12 12 12\nspace: left-posterior-superior\n"
        "space directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\nendian: little\n"
        "encoding: raw\n\n";
    for (int i = 0; i < 12 * 12 * 12; ++i) {
        const std::int32_t sample = 100 * (i % 12) + i / 12 % 12;
        text.append(reinterpret_cast<const char*>(&sample), sizeof sample);
    }
    write_file(folder / "integers.nrrd", text);
    ASSERT_TRUE(open(folder / "integers.nrrd"));
    EXPECT_EQ(device(), "CPU");
    EXPECT_TRUE(window->banner().contains(
        "The CPU extracts the surfaces of this scan: GPUs take no samples of type int32."))
        << window->banner().toStdString();
    expect_mesh_of_cpu();

    // The device gets the next scan.
    write_nrrd(folder / "ball.nrrd", 24, 25, 13, ball(12, 12, 6, 8));
    ASSERT_TRUE(open(folder / "ball.nrrd"));
    EXPECT_TRUE(device().startsWith("llvmpipe"));
    expect_mesh_of_cpu();
}

}  // namespace
}  // namespace marrow::test
