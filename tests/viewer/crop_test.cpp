// Tests the crop box: on slices, in 3D and as numbers, it restricts the surface.
#include <QSpinBox>

#include <marrow/isosurface.h>
#include <marrow/volume_filters.h>

#include "support/viewer_ball.h"
#include "views/scene_parts.h"

namespace marrow::test {
namespace {

using viewer::Plane;
using viewer::SampleBox;

class Crop : public BallViewer {
  protected:
    /// The surface is that of the samples in the box.
    void expect_surface_of(const SampleBox& box) {
        ASSERT_TRUE(settle());
        const auto shape = window->surfaces().exact(session().parameters().current);
        ASSERT_TRUE(shape);
        const Volume cropped = crop(session().scan()->volume, box.first, box.last);
        const Mesh expected = extract_isosurface(cropped, session().current()->isovalue, {.closed = true});
        EXPECT_EQ(shape->mesh->points, expected.points);
        EXPECT_EQ(shape->mesh->triangles, expected.triangles);
        EXPECT_EQ(shape->measures->boundary_edges, 0);
    }

    QPoint handle(const viewer::CropSide& side, double index) {
        Vec3d position = viewer::CropBox::handle(session().crop(), side);
        position[side.axis] = index;
        return view()->widget_point(session().scan()->volume.geometry().physical(position))->toPoint();
    }
};

TEST_F(Crop, IsDraggedOnASlice) {
    const SampleBox whole = session().whole_scan();
    key(Qt::Key_K);
    EXPECT_EQ(session().tool(), viewer::Tool::crop);
    viewer::SliceView* axial = window->slice_view(Plane::axial);
    const auto at = [&](double x, double y) { return axial->widget_point({x, y, 12}).toPoint(); };
    drag(axial, at(kSide - 0.5, 20), at(27.5, 20));
    const SampleBox right{{0, 0, 0}, {27, kSide - 1, kSlices - 1}};
    ASSERT_TRUE(session().parameters().crop == right);
    expect_surface_of(right);
    EXPECT_TRUE(window->command().contains(" --crop vox:0,27,0,47,0,24"));
    // A little more than half of the ball remains.
    const auto volume = window->surfaces().exact(session().parameters().current)->measures->volume;
    EXPECT_NEAR(volume, 4.0 / 3 * M_PI * std::pow(kRadius, 3) * 0.65, 1500);

    drag(axial, at(-0.5, -0.5), at(19.5, 14.5));  // a corner moves two sides in one step of undo
    const SampleBox corner{{20, 15, 0}, {27, kSide - 1, kSlices - 1}};
    ASSERT_TRUE(session().parameters().crop == corner);
    expect_surface_of(corner);
    key(Qt::Key_Z, Qt::ControlModifier);
    ASSERT_TRUE(session().parameters().crop == right);
    expect_surface_of(right);
    key(Qt::Key_Z, Qt::ControlModifier);
    EXPECT_FALSE(session().parameters().crop);
    EXPECT_FALSE(window->command().contains("--crop"));
    expect_surface_of(whole);
    key(Qt::Key_Z, Qt::ControlModifier | Qt::ShiftModifier);
    expect_surface_of(right);
    // A click beside the handles moves the crosshair. The slice is dim outside the box.
    click_on_slice(Plane::axial, {14, 33, 12});
    EXPECT_NEAR(session().crosshair()[0], 14, 0.51);
    const QImage slice = axial->grab().toImage();
    EXPECT_LT(qGray(slice.pixel(at(36, 22))), 0.6 * qGray(slice.pixel(at(12, 22))));
}

TEST_F(Crop, IsDraggedInSpace) {
    key(Qt::Key_1);  // from the front, x is horizontal and z is up
    key(Qt::Key_K);
    for (int i = 0; i < 8; ++i) {  // zoom out, because the box is larger than the ball
        const QPoint middle = view()->rect().center();
        QWheelEvent wheel(middle, view()->mapToGlobal(middle), QPoint(), QPoint(0, -120), Qt::NoButton,
                          Qt::NoModifier, Qt::NoScrollPhase, false);
        QApplication::sendEvent(view(), &wheel);
    }
    ASSERT_TRUE(settle());
    const Vec3d direction = view()->view_direction();
    key(Qt::Key_N);
    const int before = count(picture(), warm);
    key(Qt::Key_K);
    const viewer::CropSide top{2, true};
    drag(view(), handle(top, kSlices - 0.5), handle(top, 12.5));
    ASSERT_TRUE(session().parameters().crop);
    EXPECT_NEAR(session().crop().last[2], 12, 1);
    EXPECT_EQ(session().crop().first, session().whole_scan().first);
    EXPECT_EQ(distance(view()->view_direction(), direction), 0);  // the drag moved the box, not the camera
    expect_surface_of(session().crop());
    key(Qt::Key_N);  // hides the lines and handles of the box, which have warm colours too
    EXPECT_NEAR(count(picture(), warm), before / 2, before / 8);
    // With another tool, the same drag rotates the camera.
    drag(view(), handle(top, 12.5), handle(top, 5) + QPoint(40, 0));
    EXPECT_GT(distance(view()->view_direction(), direction), 0.01);
    EXPECT_NEAR(session().crop().last[2], 12, 1);
}

TEST_F(Crop, IsTypedIn) {
    const auto type = [&](const char* name, int sample) {
        auto* box = window->findChild<QSpinBox*>(name);
        box->selectAll();
        QTest::keyClicks(box, QString::number(sample));
        QTest::keyClick(box, Qt::Key_Return);
    };
    type("crop_z0", 9);
    type("crop_y1", 30);
    const SampleBox box{{0, 0, 9}, {kSide - 1, 30, kSlices - 1}};
    ASSERT_TRUE(session().parameters().crop == box);
    expect_surface_of(box);
    type("crop_y0", 44);  // not beyond the opposite side
    EXPECT_EQ(session().crop().first[1], 29);
    EXPECT_EQ(window->findChild<QSpinBox*>("crop_y0")->value(), 29);
    expect_surface_of(session().crop());
    key(Qt::Key_Z, Qt::ControlModifier);
    ASSERT_TRUE(session().parameters().crop == box);
    EXPECT_EQ(window->findChild<QSpinBox*>("crop_y0")->value(), 0);
    window->findChild<QAction*>("whole_scan")->trigger();
    EXPECT_FALSE(session().parameters().crop);
    EXPECT_EQ(window->findChild<QSpinBox*>("crop_z0")->value(), 0);
    // A cut shows the slice only inside the box.
    type("crop_x1", 20);
    click_on_slice(Plane::coronal, {24, 22, 12});
    key(Qt::Key_5);
    key(Qt::Key_C);
    ASSERT_TRUE(settle());
    const auto hit = [&](double x) {
        const QPoint point = view()->widget_point(position_of({x, 22, 12}))->toPoint();
        const auto position = view()->position_at(point);
        return position && std::abs((*position)[2] - position_of(kMiddle)[2]) < 0.01;
    };
    EXPECT_TRUE(hit(16));
    EXPECT_FALSE(hit(28));
}

TEST_F(Crop, SlicesShowTheComponentThatTheSurfaceKeeps) {
    const auto large = ball(18, 20, 12, 12), small = ball(38, 36, 12, 7);
    write_nrrd(folder / "two.nrrd", kSide, kSide, kSlices,
               [&](int x, int y, int z) { return std::max(large(x, y, z), small(x, y, z)); });
    ASSERT_TRUE(open(folder / "two.nrrd"));
    session().set_isovalue(0);
    ASSERT_TRUE(settle());
    const int id = session().parameters().current;
    const auto rightmost = [&](Plane plane) {
        double x = 0;
        for (const QLineF& line : window->slice_view(plane)->contour_of(id))
            x = std::max({x, line.x1(), line.x2()});
        return x;
    };
    EXPECT_NEAR(rightmost(Plane::axial), 38 + 7, 0.1);
    window->findChild<QCheckBox*>("largest")->click();
    ASSERT_TRUE(settle());
    EXPECT_NEAR(rightmost(Plane::axial), 18 + 12, 0.1);
    // The box determines which component is the largest.
    session().move_crop_side({0, false}, 26);
    ASSERT_TRUE(settle());
    EXPECT_NEAR(rightmost(Plane::axial), 38 + 7, 0.1);
    session().undo_stack().undo();
    ASSERT_TRUE(settle());
    EXPECT_NEAR(rightmost(Plane::axial), 18 + 12, 0.1);
    window->findChild<QCheckBox*>("largest")->click();
    ASSERT_TRUE(settle());
    EXPECT_NEAR(rightmost(Plane::axial), 38 + 7, 0.1);
}

}  // namespace
}  // namespace marrow::test
