// Tests what slices show, and what is measured on them.
#include <fstream>
#include <random>
#include <sstream>

#include "support/reading_checks.h"
#include "support/viewer_ball.h"
#include "views/slice_geometry.h"

namespace marrow::test {
namespace {

using viewer::Plane;

constexpr std::array kPlanes{Plane::axial, Plane::coronal, Plane::sagittal};

// The gantry is tilted by this angle: slices are turned about the x axis, but stacked along z.
constexpr double kTilt = 20 * M_PI / 180;
const std::string kTiltedDirections =
    "(1,0,0) (0," + std::to_string(std::cos(kTilt)) + "," + std::to_string(-std::sin(kTilt)) + ") (0,0,2)";

class Slices : public BallViewer {
  protected:
    /// Opens the samples of the ball with the directions of a tilted gantry.
    void open_tilted() {
        std::ifstream in(scan, std::ios::binary);
        std::stringstream text;
        text << in.rdbuf();
        std::string bytes = text.str();
        const std::string straight = "(1,0,0) (0,1,0) (0,0,2)";
        bytes.replace(bytes.find(straight), straight.size(), kTiltedDirections);
        write_file(folder / "tilted.nrrd", bytes);
        ASSERT_TRUE(open(folder / "tilted.nrrd"));
        session().set_isovalue(0);
        ASSERT_TRUE(settle());
    }

    /// Measures the angle at the middle of a slice between two directions on the screen.
    double measure_angle(Plane plane, const QPoint& one, const QPoint& other) {
        key(Qt::Key_A);
        viewer::SliceView* slice = window->slice_view(plane);
        const QPoint middle = slice->rect().center();
        for (const QPoint& point : {middle + one, middle, middle + other})
            QTest::mouseClick(slice, Qt::LeftButton, Qt::NoModifier, point);
        key(Qt::Key_N);
        return session().parameters().measurements.back().value();
    }
};

TEST(SliceGeometry, IsTrueToScale) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> skew(-0.4, 0.4), at(0, 8);
    for (int i = 0; i < 50; ++i) {
        Geometry geometry;
        geometry.dims = {9, 9, 9};
        geometry.spacing = {0.7, 1.1, 1.9};
        for (std::size_t axis = 0; axis < 3; ++axis) {
            Vec3d along{skew(random), skew(random), skew(random)};
            along[axis] += i % 2 == 0 ? 1 : -1;
            for (std::size_t patient = 0; patient < 3; ++patient)
                geometry.direction[patient][axis] = along[patient] / length(along);
        }
        for (const Plane plane : kPlanes) {
            const viewer::SliceGeometry slice = slice_geometry(geometry, plane);
            const Vec3d a{at(random), at(random), at(random)};
            Vec3d b{at(random), at(random), at(random)};
            b[static_cast<std::size_t>(slice.through)] = a[static_cast<std::size_t>(slice.through)];
            const QPointF drawn = slice.to_mm.map(slice.to_slice(a)) - slice.to_mm.map(slice.to_slice(b));
            EXPECT_NEAR(std::hypot(drawn.x(), drawn.y()),
                        distance(geometry.physical(a), geometry.physical(b)), 1e-9);
        }
    }
}

TEST_F(Slices, AnAngleOnATiltedScanIsTheAngleOnTheScreen) {
    open_tilted();
    for (const Plane plane : kPlanes) {
        EXPECT_NEAR(measure_angle(plane, {0, -50}, {50, 0}), 90, 1e-6) << static_cast<int>(plane);
        EXPECT_NEAR(measure_angle(plane, {-40, 30}, {40, 30}), 106.26, 0.01) << static_cast<int>(plane);
    }
    // Up is superior, as the letters say.
    viewer::SliceView* sagittal = window->slice_view(Plane::sagittal);
    const Geometry& geometry = session().scan()->volume.geometry();
    const QPointF from = sagittal->widget_point({24, 20, 5}), to = sagittal->widget_point({24, 20, 15});
    EXPECT_NEAR(from.x(), to.x(), 1e-6);
    EXPECT_GT(from.y(), to.y());
    const Vec3d step = geometry.physical({24, 20, 15}) - geometry.physical({24, 20, 5});
    EXPECT_NEAR(step[2], length(step), 1e-9);
}

TEST_F(Slices, ATiltedScanIsDrawnWhereItsIndicesAre) {
    open_tilted();
    key(Qt::Key_X);
    viewer::SliceView* slice = window->slice_view(Plane::sagittal);
    const QImage image = slice->grab().toImage();
    // White inside the ball, black outside, at points that would be elsewhere without the shear.
    for (const Vec3d& index : {Vec3d{24, 22, 7}, Vec3d{24, 22, 17}, Vec3d{24, 13, 10}, Vec3d{24, 31, 14}})
        EXPECT_GT(qGray(image.pixel(slice->widget_point(index).toPoint())), 100)
            << index[1] << ' ' << index[2];
    for (const Vec3d& index : {Vec3d{24, 4, 3}, Vec3d{24, 44, 3}, Vec3d{24, 44, 20}})
        EXPECT_LT(qGray(image.pixel(slice->widget_point(index).toPoint())), 60)
            << index[1] << ' ' << index[2];
}

TEST_F(Slices, TheCropBoxIsDraggedOnATiltedScan) {
    open_tilted();
    key(Qt::Key_K);
    viewer::SliceView* slice = window->slice_view(Plane::sagittal);
    const auto at = [&](double y, double z) { return slice->widget_point({24, y, z}).toPoint(); };
    drag(slice, at(-0.5, 4), at(9.5, 4));
    drag(slice, at(30, kSlices - 0.5), at(20, 19.5));  // the level side moves by its height
    const viewer::SampleBox box = session().crop();
    EXPECT_EQ(box.first, (std::array<std::int64_t, 3>{0, 10, 0}));
    EXPECT_EQ(box.last, (std::array<std::int64_t, 3>{kSide - 1, kSide - 1, 19}));
}

TEST_F(BallViewer, EdgesFadeWhereTrianglesAreSmall) {
    const auto edges_cover = [&] {
        key(Qt::Key_S);
        const int surface = count(picture(), warm);
        key(Qt::Key_W);
        return 1 - static_cast<double>(count(picture(), warm)) / surface;
    };
    const auto turn_wheel = [&](int step) {
        const QPoint middle = view()->rect().center();
        QWheelEvent event(middle, view()->mapToGlobal(middle), {}, {0, step}, Qt::NoButton, Qt::NoModifier,
                          Qt::NoScrollPhase, false);
        QApplication::sendEvent(view(), &event);
    };
    key(Qt::Key_X);
    EXPECT_GT(edges_cover(), 0.05);
    for (int i = 0; i < 18; ++i) turn_wheel(-120);
    EXPECT_LT(edges_cover(), 0.02);
}

// The 3D view is drawn again only if something in it changes.
TEST_F(Slices, AWindowIsChangedWithoutDrawingIn3D) {
    viewer::SliceView* slice = window->slice_view(Plane::axial);
    const QPoint middle = slice->rect().center();
    const QImage before = slice->grab().toImage();
    const int frames = view()->frames();
    drag(slice, middle, middle + QPoint(60, 30), Qt::RightButton);
    ASSERT_TRUE(settle());
    EXPECT_EQ(view()->frames(), frames);
    EXPECT_NE(slice->grab().toImage(), before);

    key(Qt::Key_C);  // the cut shows samples, so now the window matters
    key(Qt::Key_5);
    const QImage cut = picture();
    drag(slice, middle, middle - QPoint(60, 0), Qt::RightButton);
    EXPECT_NE(picture(), cut);
}

TEST_F(Slices, AHiddenCrosshairIsMovedWithoutDrawingIn3D) {
    const int frames = view()->frames();
    click_on_slice(Plane::axial, {17, 30, 12});
    ASSERT_TRUE(settle());
    EXPECT_GT(view()->frames(), frames);
    key(Qt::Key_X);
    ASSERT_TRUE(settle());
    const int hidden = view()->frames();
    click_on_slice(Plane::axial, {30, 17, 12});
    ASSERT_TRUE(settle());
    EXPECT_EQ(view()->frames(), hidden);
}

// A wall two samples thick, where a sample is smaller than a pixel.
TEST_F(ViewerTest, ContoursDoNotFillThinBone) {
    constexpr int kWide = 250, kWall = 60;
    write_nrrd(folder / "wall.nrrd", kWide, kWide, 4,
               [](int x, int, int) { return x == kWall || x == kWall + 1 ? 1000 : -1000; });
    ASSERT_TRUE(open(folder / "wall.nrrd"));
    session().change("colour", {}, [](viewer::Parameters& p) { p.surfaces[0].colour = Qt::red; });
    viewer::SliceView* slice = window->slice_view(Plane::axial);
    ASSERT_LT(slice->widget_point({1, 0, 0}).x() - slice->widget_point({0, 0, 0}).x(), 1);
    const auto green = [&] {  // the wall is white, and the lines are red
        const QImage image = slice->grab().toImage();
        const QPoint wall = slice->widget_point({kWall + 0.5, 100, 0}).toPoint();
        int sum = 0;
        for (int x = wall.x() - 3; x <= wall.x() + 3; ++x) sum += qGreen(image.pixel(x, wall.y()));
        return sum;
    };
    const int with_lines = green();
    session().change("visibility", {}, [](viewer::Parameters& p) { p.surfaces[0].visible = false; });
    EXPECT_GT(with_lines, 0.2 * green());
}

// A head CT whose gantry was tilted by 18.5 degrees.
TEST_F(ViewerTest, MeasuresTrueAnglesOnARealTiltedScan) {
    MARROW_TEST_SCAN(folder_of_scan, "qa_ct_ge_tilt");
    window->open(folder_of_scan, {.resample = true});
    ASSERT_TRUE(wait([&] { return !window->busy(); }) && session().scan() && settle());
    for (const Plane plane : kPlanes) {
        viewer::SliceView* slice = window->slice_view(plane);
        key(Qt::Key_A);
        const QPoint middle = slice->rect().center();
        for (const QPoint& point : {middle + QPoint(0, -40), middle, middle + QPoint(40, 0)})
            QTest::mouseClick(slice, Qt::LeftButton, Qt::NoModifier, point);
        EXPECT_NEAR(session().parameters().measurements.back().value(), 90, 1e-6) << static_cast<int>(plane);
    }
}

}  // namespace
}  // namespace marrow::test
