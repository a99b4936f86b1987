// Tests the state and the image of the viewer after mouse and key events.
#include <QCheckBox>
#include <QListWidget>
#include <QSpinBox>

#include <marrow/isosurface.h>

#include "cranium.h"
#include "support/viewer_ball.h"

// Qt, VTK and OpenGL drivers keep memory until the process ends. AddressSanitizer would report it as a leak.
extern "C" const char* __asan_default_options() {
    return "detect_leaks=0";
}

namespace marrow::test {
namespace {

using viewer::Parameters;
using viewer::Plane;

TEST_F(BallViewer, AnotherScanStartsOver) {
    session().add_surface("second", 300, {}, 1);
    key(Qt::Key_K);
    session().move_crop_side({0, true}, 30);
    key(Qt::Key_C);
    key(Qt::Key_A);
    click_on_slice(viewer::Plane::axial, kMiddle);
    EXPECT_EQ(session().picked().size(), 1u);
    window->findChild<QCheckBox*>("largest")->click();
    write_nrrd(folder / "other.nrrd", 20, 21, 22, ball(10, 10, 11, 5));
    ASSERT_TRUE(open(folder / "other.nrrd"));
    EXPECT_TRUE(session().picked().empty());
    EXPECT_EQ(session().tool(), viewer::Tool::navigate);
    EXPECT_TRUE(window->findChild<QAction*>("navigate")->isChecked());
    EXPECT_EQ(session().parameters().surfaces.size(), 1u);
    EXPECT_FALSE(session().parameters().crop);
    EXPECT_FALSE(session().parameters().cut.plane);
    EXPECT_FALSE(window->findChild<QCheckBox*>("largest")->isChecked());
    EXPECT_EQ(window->findChild<QSpinBox*>("crop_z1")->value(), 21);
    EXPECT_FALSE(session().undo_stack().canUndo());
    EXPECT_TRUE(window->command().contains("other.nrrd"));
    EXPECT_FALSE(session().has_unsaved_work());
}

TEST_F(BallViewer, KeysSelectTheNextSurface) {
    auto* next = window->findChild<QAction*>("next_surface");
    EXPECT_FALSE(next->isEnabled());
    const int first = session().parameters().current;
    session().add_surface("second", 300, {}, 1);
    const int second = session().parameters().current;
    ASSERT_NE(first, second);
    key(Qt::Key_Tab, Qt::ControlModifier);
    EXPECT_EQ(session().parameters().current, first);
    key(Qt::Key_Tab, Qt::ControlModifier);
    EXPECT_EQ(session().parameters().current, second);
}

// Whoever learns a tool from its button learns its key.
TEST_F(BallViewer, TooltipsNameTheKeys) {
    int keys = 0;
    for (const QAction* action : window->actions()) {
        if (action->shortcut().isEmpty()) continue;
        ++keys;
        EXPECT_TRUE(action->toolTip().contains(action->shortcut().toString(QKeySequence::NativeText)))
            << action->toolTip().toStdString();
    }
    EXPECT_GT(keys, 20);
}

// The keyboard is in the 3D view from the start, not in a field or on a button.
TEST_F(BallViewer, TheFirstScanHasTheKeyboard) {
    QApplication::setActiveWindow(window.get());
    EXPECT_EQ(window->focusWidget(), view());
}

TEST_F(BallViewer, ShowsTheSurfaceThatTheLibraryExtracts) {
    const auto& dims = session().scan()->volume.geometry().dims;
    EXPECT_EQ(dims, (std::array<std::int64_t, 3>{kSide, kSide, kSlices}));
    const Mesh expected = extract_isosurface(session().scan()->volume, 0, {.closed = true});
    const auto shape = window->surfaces().exact(session().parameters().current);
    ASSERT_TRUE(shape);
    EXPECT_EQ(shape->mesh->points, expected.points);
    EXPECT_EQ(shape->mesh->normals, expected.normals);
    EXPECT_EQ(shape->mesh->triangles, expected.triangles);
    EXPECT_NEAR(shape->measures->volume, 4.0 / 3 * M_PI * std::pow(kRadius, 3), 300);

    // A ball appears as a disc in the middle of the view.
    const QImage image = picture();
    const Vec3d centre = position_of(kMiddle);
    const QPointF middle = view()->widget_point(centre).value();
    const int disc = count(image, warm);
    const double radius = std::sqrt(disc / M_PI);
    EXPECT_GT(radius, 0.25 * view()->height());
    EXPECT_NEAR(middle.x(), view()->width() / 2.0, 3);
    EXPECT_NEAR(middle.y(), view()->height() / 2.0, 3);
}

TEST_F(BallViewer, CyclesThroughTheDrawModes) {
    key(Qt::Key_1);
    const int surface = count(picture(), warm);
    key(Qt::Key_W);
    EXPECT_EQ(session().parameters().mode, viewer::DrawMode::edges);
    const QImage edges = picture();
    key(Qt::Key_W);
    EXPECT_EQ(session().parameters().mode, viewer::DrawMode::wireframe);
    const int wireframe = count(picture(), warm);
    key(Qt::Key_W);
    EXPECT_EQ(session().parameters().mode, viewer::DrawMode::points);
    const int points = count(picture(), warm);
    key(Qt::Key_W);
    EXPECT_EQ(session().parameters().mode, viewer::DrawMode::surface);
    EXPECT_NEAR(count(picture(), warm), surface, surface / 100);
    EXPECT_LT(count(edges, warm), surface);
    EXPECT_LT(wireframe, 0.9 * surface);
    EXPECT_LT(points, wireframe);
    EXPECT_GT(points, 0);
    key(Qt::Key_W);
    key(Qt::Key_S);
    EXPECT_EQ(session().parameters().mode, viewer::DrawMode::surface);
}

TEST_F(BallViewer, RotatesWithTheMouse) {
    key(Qt::Key_1);
    ASSERT_TRUE(settle());
    EXPECT_NEAR(view()->view_direction()[1], 1, 1e-6);
    const Parameters before = session().parameters();
    const QPoint middle = view()->rect().center();
    drag(view(), middle, middle + QPoint(120, 0));
    ASSERT_TRUE(settle());
    EXPECT_LT(view()->view_direction()[1], 0.98);
    EXPECT_NEAR(view()->view_direction()[2], 0, 1e-3);
    EXPECT_TRUE(session().parameters() == before);
}

TEST_F(BallViewer, SlicesFollowAClick) {
    const Vec3d target{17, 30, 12};
    click_on_slice(Plane::axial, target);
    for (std::size_t a = 0; a < 3; ++a) EXPECT_NEAR(session().crosshair()[a], target[a], 0.51) << a;
    // The other slices show the crosshair too.
    for (const Plane plane : {Plane::coronal, Plane::sagittal}) {
        viewer::SliceView* slice = window->slice_view(plane);
        const QImage image = slice->grab().toImage();
        const QPoint at = slice->widget_point(session().crosshair()).toPoint();
        const QColor expected = plane == Plane::coronal ? QColor(0xed, 0xd5, 0x4c) : QColor(0x6e, 0xb0, 0x4b);
        bool upright = false;
        for (const int x : {at.x() - 1, at.x(), at.x() + 1})
            upright = upright || std::abs(image.pixelColor(x, 30).hue() - expected.hue()) < 12;
        EXPECT_TRUE(upright) << static_cast<int>(plane);
    }
    // Arrow keys move by one slice.
    const double k = session().crosshair()[2];
    window->slice_view(Plane::axial)->setFocus();
    QTest::keyClick(window->slice_view(Plane::axial), Qt::Key_Up);
    EXPECT_EQ(session().crosshair()[2], std::round(k) + 1);
}

TEST_F(BallViewer, AClickOnTheSurfaceMovesTheCrosshairThere) {
    key(Qt::Key_1);
    ASSERT_TRUE(settle());
    const Vec3d centre = position_of(kMiddle);
    QTest::mouseClick(view(), Qt::LeftButton, Qt::NoModifier, view()->rect().center() + QPoint(20, -30));
    const Vec3d hit = session().crosshair_position();
    EXPECT_NEAR(distance(hit, centre), kRadius, 0.3);
    EXPECT_LT(hit[1], centre[1] - 5);  // the patient's front
    const QPointF point = view()->widget_point(hit).value();
    EXPECT_NEAR(point.x(), view()->rect().center().x() + 20, 1.5);
    EXPECT_NEAR(point.y(), view()->rect().center().y() - 30, 1.5);
    // A click beside the ball hits nothing.
    QTest::mouseClick(view(), Qt::LeftButton, Qt::NoModifier, QPoint(4, 4));
    EXPECT_EQ(session().crosshair_position(), hit);
}

TEST_F(BallViewer, ViewsFromSixSides) {
    const std::vector<std::pair<int, Vec3d>> expected{{Qt::Key_1, {0, 1, 0}},  {Qt::Key_2, {0, -1, 0}},
                                                      {Qt::Key_3, {-1, 0, 0}}, {Qt::Key_4, {1, 0, 0}},
                                                      {Qt::Key_5, {0, 0, -1}}, {Qt::Key_6, {0, 0, 1}}};
    const Vec3d centre = position_of(kMiddle);
    for (const auto& [k, direction] : expected) {
        key(k);
        EXPECT_NEAR(distance(view()->view_direction(), direction), 0, 1e-6);
    }
    // Seen from the front, the patient's left is on the right and superior is up.
    key(Qt::Key_1);
    ASSERT_TRUE(settle());
    EXPECT_GT(view()->widget_point({centre[0] + 5, centre[1], centre[2]})->x(),
              view()->widget_point(centre)->x() + 5);
    EXPECT_LT(view()->widget_point({centre[0], centre[1], centre[2] + 5})->y(),
              view()->widget_point(centre)->y() - 5);
}

TEST_F(BallViewer, CutsThroughTheCrosshair) {
    click_on_slice(Plane::coronal, {24, 22, 14});
    const double height = position_of({0, 0, std::round(session().crosshair()[2])})[2];
    key(Qt::Key_5);  // from above
    ASSERT_TRUE(settle());
    const QPoint middle = view()->rect().center();
    const auto uncut = view()->position_at(middle);
    ASSERT_TRUE(uncut);
    EXPECT_NEAR((*uncut)[2], position_of(kMiddle)[2] + kRadius, 0.3);

    key(Qt::Key_C);
    EXPECT_EQ(session().parameters().cut.plane, Plane::axial);
    const auto cut = view()->position_at(middle);
    ASSERT_TRUE(cut);
    EXPECT_NEAR((*cut)[2], height, 1e-3);
    // The cut shows the grey slice instead of the colour of the surface.
    const QImage face = picture();
    const QColor colour = face.pixelColor(middle + QPoint(25, 25));
    EXPECT_LT(colour.saturation(), 20) << colour.name().toStdString();

    key(Qt::Key_F);  // shows the upper half, which looks like the entire ball from above
    const auto flipped = view()->position_at(middle);
    ASSERT_TRUE(flipped);
    EXPECT_NEAR((*flipped)[2], (*uncut)[2], 1e-3);
    key(Qt::Key_Z, Qt::ControlModifier);
    key(Qt::Key_Z, Qt::ControlModifier);
    EXPECT_FALSE(session().parameters().cut.plane);
}

TEST_F(BallViewer, MeasuresOnSlices) {
    key(Qt::Key_D);
    EXPECT_EQ(session().tool(), viewer::Tool::distance);
    click_on_slice(Plane::coronal, {10, 22, 5});
    EXPECT_EQ(session().picked().size(), 1u);
    click_on_slice(Plane::coronal, {34, 22, 15});
    ASSERT_EQ(session().parameters().measurements.size(), 1u);
    const double pixel = 0.7;  // mm on the screen, approximately
    EXPECT_NEAR(session().parameters().measurements[0].value(), std::hypot(24, 20), 2 * pixel);

    key(Qt::Key_A);
    click_on_slice(Plane::coronal, {34, 22, 12});
    click_on_slice(Plane::coronal, {14, 22, 12});
    click_on_slice(Plane::coronal, {34, 22, 22});
    ASSERT_EQ(session().parameters().measurements.size(), 2u);
    EXPECT_NEAR(session().parameters().measurements[1].value(), 45, 4);
    EXPECT_EQ(window->findChild<QListWidget*>("measurements")->count(), 2);

    key(Qt::Key_Z, Qt::ControlModifier);
    EXPECT_EQ(session().parameters().measurements.size(), 1u);
    click_on_slice(Plane::coronal, {34, 22, 12});
    key(Qt::Key_Escape);
    EXPECT_TRUE(session().picked().empty());
}

TEST_F(BallViewer, MeasuresOnTheSurface) {
    key(Qt::Key_1);
    key(Qt::Key_D);
    ASSERT_TRUE(settle());
    const Vec3d centre = position_of(kMiddle);
    // Two points on the front of the ball, left and right of its centre.
    const Vec3d from{centre[0] - 9, centre[1] - 12, centre[2]}, to{centre[0] + 9, centre[1] - 12, centre[2]};
    const int before =
        count(view()->grabFramebuffer(), [](QRgb c) { return qBlue(c) > 180 && qRed(c) < 120; });
    for (const Vec3d& p : {from, to})
        QTest::mouseClick(view(), Qt::LeftButton, Qt::NoModifier, view()->widget_point(p)->toPoint());
    ASSERT_EQ(session().parameters().measurements.size(), 1u);
    EXPECT_NEAR(session().parameters().measurements[0].value(), 18, 0.5);
    const int line = count(picture(), [](QRgb c) { return qBlue(c) > 180 && qRed(c) < 120; });
    EXPECT_GT(line, before + 100);
}

TEST_F(BallViewer, ShowsSeveralSurfaces) {
    key(Qt::Key_X);  // the crosshair is red too
    session().add_surface("core", 600, QColor(200, 40, 40), 1);
    ASSERT_TRUE(settle());
    EXPECT_EQ(session().parameters().surfaces.size(), 2u);
    const auto red = [](QRgb c) { return qRed(c) > 60 && qRed(c) > 2.5 * qGreen(c); };
    EXPECT_EQ(count(picture(), red), 0);  // inside the opaque ball
    session().select_surface(session().parameters().surfaces[0].id);
    window->findChild<QSlider*>("opacity")->setValue(15);
    EXPECT_NEAR(session().current()->opacity, 0.15, 1e-9);
    const auto reddish = [](QRgb c) { return qRed(c) > 60 && qRed(c) > 1.35 * qGreen(c); };
    EXPECT_GT(count(picture(), reddish), 500);  // visible through the ball
    // Names, visibility, removal and undo.
    const auto eyes = window->findChildren<QToolButton*>("eye");
    ASSERT_EQ(eyes.size(), 2);
    QTest::mouseClick(eyes[0], Qt::LeftButton);
    EXPECT_FALSE(session().parameters().surfaces[0].visible);
    EXPECT_GT(count(picture(), red), 500);
    session().remove_surface(session().parameters().surfaces[1].id);
    EXPECT_EQ(session().parameters().surfaces.size(), 1u);
    key(Qt::Key_Z, Qt::ControlModifier);
    ASSERT_EQ(session().parameters().surfaces.size(), 2u);
    EXPECT_EQ(session().parameters().surfaces[1].name, "core");
    EXPECT_GT(count(picture(), red), 500);
}

TEST_F(BallViewer, DraggingChangesTheWindow) {
    const viewer::Window before = session().parameters().window;
    viewer::SliceView* slice = window->slice_view(Plane::axial);
    const QPoint middle = slice->rect().center();
    drag(slice, middle, middle + QPoint(40, 20), Qt::RightButton);
    EXPECT_GT(session().parameters().window.width, before.width);
    EXPECT_GT(session().parameters().window.centre, before.centre);
    EXPECT_EQ(session().undo_stack().undoText(), "window");
    key(Qt::Key_Z, Qt::ControlModifier);
    EXPECT_TRUE(session().parameters().window == before);  // the drag is one step of undo
}

// Loads a real scan and drags the isovalue from bone to skin.
TEST_F(ViewerTest, CraniumFromBoneToSkin) {
    const std::optional<Volume> scan = bench::cranium();
    if (!scan) GTEST_SKIP() << "no Cranium: install invesalius-examples";
    write_nrrd(folder / "cranium.nrrd", 256, 256, 108,
               [&](int x, int y, int z) { return scan->samples<std::int16_t>()[(z * 256 + y) * 256 + x]; });
    ASSERT_TRUE(open(folder / "cranium.nrrd"));
    EXPECT_TRUE(session().scan()->hounsfield);
    EXPECT_EQ(session().current()->isovalue, 225.5);
    EXPECT_GT(window->surfaces().preview_level(), 0);
    key(Qt::Key_1);
    const int bone = count(picture(), warm);

    int previews = 0, exact = 0;
    QObject::connect(&window->surfaces(), &viewer::Surfaces::shape_changed, window.get(),
                     [&](int id) { (window->surfaces().shape(id)->level > 0 ? previews : exact) += 1; });
    viewer::HistogramBar* histogram = window->histogram_bar();
    const int y = histogram->height() / 2;
    drag(histogram, QPoint(qRound(histogram->x_of(225.5)), y), QPoint(qRound(histogram->x_of(-300.5)), y),
         Qt::LeftButton, 20);
    ASSERT_TRUE(settle());
    EXPECT_GT(previews, 0);
    EXPECT_GT(exact, 0);
    const double dropped_at = session().current()->isovalue;
    EXPECT_NEAR(dropped_at, -300, 4);
    const auto shape = window->surfaces().exact(session().parameters().current);
    ASSERT_TRUE(shape);
    EXPECT_EQ(shape->isovalue, dropped_at);
    EXPECT_EQ(shape->level, 0);
    const Mesh expected = extract_isosurface(session().scan()->volume, dropped_at, {.closed = true});
    EXPECT_EQ(shape->mesh->points, expected.points);
    EXPECT_EQ(shape->mesh->triangles, expected.triangles);
    EXPECT_GT(count(picture(), warm), 1.05 * bone);  // skin covers a larger area than bone

    key(Qt::Key_Z, Qt::ControlModifier);  // the drag is one step of undo
    EXPECT_EQ(session().current()->isovalue, 225.5);
    EXPECT_NEAR(count(picture(), warm), bone, 0.01 * bone);
    key(Qt::Key_Z, Qt::ControlModifier | Qt::ShiftModifier);
    EXPECT_EQ(session().current()->isovalue, dropped_at);
}

}  // namespace
}  // namespace marrow::test
