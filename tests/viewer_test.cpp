// The viewer, driven by mouse and keys: what it then knows, and what it shows.
#include <cmath>
#include <random>

#include <QDialog>
#include <QListWidget>
#include <QMimeData>
#include <QTableWidget>

#include <marrow/isosurface.h>
#include <marrow/refine.h>

#include "cranium.h"
#include "dicom_series.h"
#include "viewer_window.h"

// Qt, VTK and OpenGL drivers keep memory until the process ends; AddressSanitizer, where it is on, shall not take that
// for our leak.
extern "C" const char* __asan_default_options() {
    return "detect_leaks=0";
}

namespace marrow::test {
namespace {

using viewer::Parameters;
using viewer::Plane;

constexpr int kSide = 48, kSlices = 25;  // samples 1 x 1 x 2 mm apart
constexpr double kRadius = 15;           // mm
constexpr Vec3d kMiddle{24, 22, 12};     // index

Vec3d position_of(const Vec3d& index) {  // as write_nrrd places it
    return {10 + index[0], 20 + index[1], 30 + 2 * index[2]};
}

double distance(const Vec3d& a, const Vec3d& b) {
    return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

class BallViewer : public ViewerTest {
  protected:
    void SetUp() override {
        ViewerTest::SetUp();
        if (IsSkipped()) return;
        scan = folder / "ball.nrrd";
        write_nrrd(scan, kSide, kSide, kSlices, ball(kMiddle[0], kMiddle[1], kMiddle[2], kRadius));
        ASSERT_TRUE(open(scan));
        session().set_isovalue(0);  // the ball's surface
        ASSERT_TRUE(settle());
    }

    std::filesystem::path scan;
};

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

    // A ball seen from any side is a disc; its radius on the screen is that which the camera gives it.
    const QImage image = picture();
    const Vec3d centre = position_of(kMiddle);
    const QPointF middle = view()->place_of(centre);
    const int disc = count(image, warm);
    const double radius = std::sqrt(disc / M_PI);
    EXPECT_GT(radius, 0.25 * view()->height());
    EXPECT_NEAR(middle.x(), view()->width() / 2.0, 3);
    EXPECT_NEAR(middle.y(), view()->height() / 2.0, 3);
}

TEST_F(BallViewer, WalksThroughTheWaysOfDrawing) {
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
    // The other slices' crosshairs are there.
    for (const Plane plane : {Plane::coronal, Plane::sagittal}) {
        viewer::SliceView* slice = window->slice_view(plane);
        const QImage image = slice->grab().toImage();
        const QPoint at = slice->place_of(session().crosshair()).toPoint();
        const QColor expected = plane == Plane::coronal ? QColor(0xed, 0xd5, 0x4c) : QColor(0x6e, 0xb0, 0x4b);
        bool upright = false;
        for (const int x : {at.x() - 1, at.x(), at.x() + 1})
            upright = upright || std::abs(image.pixelColor(x, 30).hue() - expected.hue()) < 12;
        EXPECT_TRUE(upright) << static_cast<int>(plane);
    }
    // And it goes slice by slice.
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
    const QPointF place = view()->place_of(hit);
    EXPECT_NEAR(place.x(), view()->rect().center().x() + 20, 1.5);
    EXPECT_NEAR(place.y(), view()->rect().center().y() - 30, 1.5);
    // Beside the ball there is nothing to click on.
    QTest::mouseClick(view(), Qt::LeftButton, Qt::NoModifier, QPoint(4, 4));
    EXPECT_EQ(session().crosshair_position(), hit);
}

TEST_F(BallViewer, SixViews) {
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
    EXPECT_GT(view()->place_of({centre[0] + 5, centre[1], centre[2]}).x(), view()->place_of(centre).x() + 5);
    EXPECT_LT(view()->place_of({centre[0], centre[1], centre[2] + 5}).y(), view()->place_of(centre).y() - 5);
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
    // The cut shows the slice: grey, where it was the surface's colour.
    const QImage face = picture();
    const QColor colour = face.pixelColor(middle + QPoint(25, 25));
    EXPECT_LT(colour.saturation(), 20) << colour.name().toStdString();

    key(Qt::Key_F);  // now what is above: from there the surface is as it was
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
    const double pixel = 0.7;  // mm, about, on the screen
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
    // Straight to the left and right on the front of the ball.
    const Vec3d from{centre[0] - 9, centre[1] - 12, centre[2]}, to{centre[0] + 9, centre[1] - 12, centre[2]};
    const int before =
        count(view()->grabFramebuffer(), [](QRgb c) { return qBlue(c) > 180 && qRed(c) < 120; });
    for (const Vec3d& p : {from, to})
        QTest::mouseClick(view(), Qt::LeftButton, Qt::NoModifier, view()->place_of(p).toPoint());
    ASSERT_EQ(session().parameters().measurements.size(), 1u);
    EXPECT_NEAR(session().parameters().measurements[0].value(), 18, 0.5);
    const int line = count(picture(), [](QRgb c) { return qBlue(c) > 180 && qRed(c) < 120; });
    EXPECT_GT(line, before + 100);
}

TEST_F(BallViewer, ExportsWhatTheShownCommandLineWrites) {
    const auto compare = [&](const char* ending, const char* what) {
        ASSERT_TRUE(settle());
        key(Qt::Key_S, Qt::ControlModifier);
        auto* dialog = window->findChild<viewer::ExportDialog*>("export_dialog");
        ASSERT_TRUE(dialog);
        const std::filesystem::path file = folder / (std::string("it's ours") + ending);
        dialog->set_file(QString::fromStdString(file.string()));
        if (std::string(what) == "RAS") dialog->findChild<QComboBox*>("space")->setCurrentIndex(1);
        const std::string line = dialog->commands().toStdString();
        bool written = false;
        const auto connection =
            QObject::connect(window.get(), &viewer::MainWindow::written, [&] { written = true; });
        QTest::keyClick(dialog, Qt::Key_Return);
        ASSERT_TRUE(wait([&] { return written; }));
        QObject::disconnect(connection);
        const std::string ours = read_file(file);
        ASSERT_FALSE(ours.empty()) << what << " " << window->banner().toStdString();

        std::filesystem::remove(file);
        const std::string programs = std::filesystem::path(MARROW_PROGRAM).parent_path();
        ASSERT_EQ(std::system(("PATH='" + programs + "':$PATH; " + line + " -q").c_str()), 0) << line;
        EXPECT_TRUE(read_file(file) == ours) << what << " " << line;
        QTest::qWait(1);  // the dialog goes
    };
    for (const viewer::ExportFormat& format : viewer::kExportFormats) compare(format.ending, "as it is");
    compare(".ply", "RAS");
    session().set_isovalue(123.456);
    compare(".stl", "a value between samples");
    window->findChild<QCheckBox*>("largest")->click();
    window->findChild<QCheckBox*>("open")->click();
    EXPECT_TRUE(session().parameters().largest && session().parameters().open);
    compare(".stl", "largest, open");
    session().set_isovalue(*session().scan()->otsu);
    EXPECT_NE(window->command().indexOf("--isovalue otsu"), -1);
    compare(".vtp", "Otsu");
    QTest::mouseClick(window->findChildren<QPushButton*>("chip").front(), Qt::LeftButton);
    EXPECT_EQ(session().current()->isovalue, 225.5);
    EXPECT_NE(window->command().indexOf("--type bone"), -1);
    compare(".stl", "bone");
}

TEST_F(BallViewer, SaysWhyAFileCannotBeWritten) {
    window->write({{session().parameters().current, folder / "nowhere" / "ball.stl"}}, Space::LPS);
    ASSERT_TRUE(wait([&] { return !window->busy(); }));
    EXPECT_NE(window->banner().indexOf("nowhere"), -1) << window->banner().toStdString();
}

TEST_F(BallViewer, ABadFileLeavesThePreviousScan) {
    const viewer::Scan* before = session().scan();
    write_file(folder / "bad.nrrd", "NRRD0005\ntype: int16\ndimension: 3\nsizes: 9 9\n\n");
    for (const auto& bad : {folder / "bad.nrrd", folder / "missing.nii", folder / "missing"}) {
        window->open(bad);
        ASSERT_TRUE(wait([&] { return !window->busy(); }));
        EXPECT_FALSE(window->banner().isEmpty());
        EXPECT_EQ(session().scan(), before);
    }
    EXPECT_GT(count(picture(), warm), 1000);
    key(Qt::Key_Escape);
    EXPECT_TRUE(window->banner().isEmpty());
}

TEST_F(BallViewer, StopsLoading) {
    const viewer::Scan* before = session().scan();
    write_nrrd(folder / "large.nrrd", 200, 200, 200, [](int x, int y, int z) { return x ^ y ^ z; });
    window->open(folder / "large.nrrd");
    EXPECT_TRUE(window->busy());
    key(Qt::Key_Escape);
    EXPECT_FALSE(window->busy());
    QTest::qWait(300);
    EXPECT_EQ(session().scan(), before);
    ASSERT_TRUE(open(folder / "large.nrrd"));  // and can be asked again
    EXPECT_EQ(session().scan()->volume.geometry().dims[0], 200);
}

TEST_F(BallViewer, OpensWhatIsDropped) {
    write_nrrd(folder / "dropped.nrrd", 20, 20, 20, ball(10, 10, 10, 5));
    const viewer::Scan* before = session().scan();
    QMimeData data;
    data.setUrls({QUrl::fromLocalFile((folder / "dropped.nrrd").c_str())});
    QDragEnterEvent enter(QPoint(100, 100), Qt::CopyAction, &data, Qt::LeftButton, Qt::NoModifier);
    QApplication::sendEvent(window.get(), &enter);
    EXPECT_TRUE(enter.isAccepted());
    QDropEvent drop(QPointF(100, 100), Qt::CopyAction, &data, Qt::LeftButton, Qt::NoModifier);
    QApplication::sendEvent(window.get(), &drop);
    ASSERT_TRUE(wait([&] { return session().scan() != before; }));
    EXPECT_EQ(session().scan()->volume.geometry().dims[0], 20);
}

TEST_F(BallViewer, AsksWhichSeries) {
    const TemporaryFolder series;
    for (const char* uid : {"1.2.3", "1.2.4"}) {
        write_series(series, std::string(uid) == "1.2.3" ? 5 : 6, uid,
                     [&](DicomWriter& slice, int) { slice.text(0x0020000e, "UI", uid); });
    }
    window->open(series.path());
    ASSERT_TRUE(wait([&] { return window->findChild<viewer::SeriesDialog*>() != nullptr; }));
    auto* dialog = window->findChild<viewer::SeriesDialog*>();
    EXPECT_EQ(dialog->findChild<QTableWidget*>("series")->rowCount(), 2);
    const viewer::Scan* before = session().scan();
    QTest::keyClick(dialog, Qt::Key_Return);  // the larger one is proposed
    ASSERT_TRUE(wait([&] { return session().scan() != before; })) << window->banner().toStdString();
    EXPECT_EQ(session().scan()->volume.geometry().dims[2], 6);
    EXPECT_NE(window->command().indexOf("--series 1.2.4"), -1) << window->command().toStdString();
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
    EXPECT_GT(count(picture(), reddish), 500);  // seen through it
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

TEST_F(BallViewer, WindowByDrag) {
    const viewer::Window before = session().parameters().window;
    viewer::SliceView* slice = window->slice_view(Plane::axial);
    const QPoint middle = slice->rect().center();
    drag(slice, middle, middle + QPoint(40, 20), Qt::RightButton);
    EXPECT_GT(session().parameters().window.width, before.width);
    EXPECT_GT(session().parameters().window.centre, before.centre);
    EXPECT_EQ(session().undo_stack().undoText(), "window");
    key(Qt::Key_Z, Qt::ControlModifier);
    EXPECT_TRUE(session().parameters().window == before);  // the drag is one step
}

TEST_F(BallViewer, PicturesHaveTheSizeAskedFor) {
    const QImage image = view()->picture({640, 360});
    EXPECT_EQ(image.size(), QSize(640, 360));
    const QImage rgb = image.convertToFormat(QImage::Format_RGB32);
    EXPECT_GT(count(rgb, warm), 640 * 360 / 20);
    // The window's own picture is as before.
    EXPECT_GT(count(picture(), warm), 1000);
    view()->set_light_background(true);
    EXPECT_GT(qGray(picture().pixel(3, 3)), 200);
}

// Whatever comes, in whatever order: it goes on, and in the end shows what was asked for.
TEST_F(BallViewer, Survives2000RandomEvents) {
    write_nrrd(folder / "other.nrrd", 60, 50, 40, ball(25, 30, 20, 22));
    write_file(folder / "bad.nrrd", "NRRD0005\ntype: int16\n\n");
    const std::vector<std::filesystem::path> inputs{scan, folder / "other.nrrd", folder / "bad.nrrd"};
    const std::vector<int> keys{Qt::Key_W, Qt::Key_S, Qt::Key_R,      Qt::Key_1,  Qt::Key_2,
                                Qt::Key_3, Qt::Key_4, Qt::Key_5,      Qt::Key_6,  Qt::Key_C,
                                Qt::Key_F, Qt::Key_D, Qt::Key_A,      Qt::Key_N,  Qt::Key_T,
                                Qt::Key_X, Qt::Key_B, Qt::Key_Escape, Qt::Key_Tab};
    std::mt19937 random(20260719);
    const auto any = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
    const auto place = [&](QWidget* widget) { return QPoint(any(widget->width()), any(widget->height())); };
    for (int event = 0; event < 2000; ++event) {
        const std::vector<QWidget*> widgets{view(), window->slice_view(Plane::axial),
                                            window->slice_view(Plane::coronal),
                                            window->slice_view(Plane::sagittal), window->histogram_bar()};
        QWidget* widget = widgets[static_cast<std::size_t>(any(5))];
        const auto button =
            std::array{Qt::LeftButton, Qt::MiddleButton, Qt::RightButton}[static_cast<std::size_t>(any(3))];
        switch (any(14)) {
            case 0:
            case 1:
                QTest::mouseClick(widget, button, any(4) ? Qt::NoModifier : Qt::ShiftModifier, place(widget));
                break;
            case 2:
            case 3: {
                const QPoint from = place(widget), to = place(widget);
                QTest::mousePress(widget, button, Qt::NoModifier, from);
                for (int i = 1; i <= 3; ++i) {
                    QMouseEvent move(QEvent::MouseMove, from + (to - from) * i / 3, Qt::NoButton, button,
                                     Qt::NoModifier);
                    QApplication::sendEvent(widget, &move);
                }
                if (any(10)) QTest::mouseRelease(widget, button, Qt::NoModifier, to);
                break;
            }
            case 4: {
                QWheelEvent wheel(place(widget), widget->mapToGlobal(QPoint(5, 5)), QPoint(),
                                  QPoint(0, any(2) ? 120 : -120), Qt::NoButton,
                                  any(3) ? Qt::NoModifier : Qt::ControlModifier, Qt::NoScrollPhase, false);
                QApplication::sendEvent(widget, &wheel);
                break;
            }
            case 5:
            case 6:
                key(keys[static_cast<std::size_t>(any(static_cast<int>(keys.size())))]);
                break;
            case 7:
                key(Qt::Key_Z, any(2) ? Qt::ControlModifier : Qt::ControlModifier | Qt::ShiftModifier);
                break;
            case 8:
                QTest::keyClick(widget, std::array{Qt::Key_Left, Qt::Key_Right, Qt::Key_PageUp,
                                                   Qt::Key_PageDown}[static_cast<std::size_t>(any(4))]);
                break;
            case 9:
                if (any(8) == 0) window->open(inputs[static_cast<std::size_t>(any(3))]);
                break;
            case 10:
                if (any(8) == 0) window->resize(700 + any(700), 500 + any(500));
                break;
            case 11: {
                const auto chips = window->findChildren<QPushButton*>("chip");
                QTest::mouseClick(chips[any(static_cast<int>(chips.size()))], Qt::LeftButton);
                break;
            }
            case 12:
                if (any(5) > 0)
                    break;  // each new surface has its shaders compiled, which takes long in software
                if (session().parameters().surfaces.size() < 4)
                    session().add_surface("s", session().current()->isovalue + any(200) - 100, {},
                                          0.2 + 0.2 * any(5));
                else
                    session().remove_surface(
                        session().parameters().surfaces[static_cast<std::size_t>(any(4))].id);
                break;
            case 13:
                for (const char* name : {"largest", "open"})
                    if (any(4) == 0) window->findChild<QCheckBox*>(name)->click();
                break;
        }
        if (any(12) == 0) QApplication::processEvents();
        ASSERT_TRUE(session().current());
        for (std::size_t a = 0; a < 3; ++a) {
            ASSERT_GE(session().crosshair()[a], 0);
            ASSERT_LE(session().crosshair()[a],
                      static_cast<double>(session().scan()->volume.geometry().dims[a] - 1));
        }
    }
    for (QAction* action : window->findChildren<QAction*>("turntable"))
        if (action->isChecked()) action->trigger();
    ASSERT_TRUE(settle());
    const Parameters& p = session().parameters();
    for (const viewer::SurfaceParameters& surface : p.surfaces) {
        const auto shape = window->surfaces().exact(surface.id);
        ASSERT_TRUE(shape);
        Mesh expected = extract_isosurface(session().scan()->volume, surface.isovalue, {.closed = !p.open});
        if (p.largest) expected = keep_components(expected, {.count = 1, .cavities = false});
        EXPECT_EQ(shape->mesh->points, expected.points);
        EXPECT_EQ(shape->mesh->triangles, expected.triangles);
    }
}

// The whole story on a real head.
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
    EXPECT_GT(count(picture(), warm), 1.05 * bone);  // skin hides bone, and more

    key(Qt::Key_Z, Qt::ControlModifier);  // the drag is one step
    EXPECT_EQ(session().current()->isovalue, 225.5);
    EXPECT_NEAR(count(picture(), warm), bone, 0.01 * bone);
    key(Qt::Key_Z, Qt::ControlModifier | Qt::ShiftModifier);
    EXPECT_EQ(session().current()->isovalue, dropped_at);
}

}  // namespace
}  // namespace marrow::test
