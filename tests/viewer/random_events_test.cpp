// Tests that the viewer survives random events in random order.
#include <random>

#include <QMessageBox>
#include <QToolButton>

#include <marrow/components.h>
#include <marrow/isosurface.h>
#include <marrow/volume_filters.h>

#include "support/viewer_ball.h"
#include "views/scene_parts.h"

namespace marrow::test {
namespace {

using viewer::Parameters;
using viewer::Plane;

class RandomEvents : public BallViewer {
  protected:
    void SetUp() override {
        BallViewer::SetUp();
        if (IsSkipped()) return;
        write_nrrd(folder / "other.nrrd", 60, 50, 40, ball(25, 30, 20, 22));
        write_nrrd(folder / "large.nrrd", 160, 160, 160, ball(80, 80, 80, 60));
        write_file(folder / "cut.nrrd", read_file(scan).substr(0, 5000));
        write_file(folder / "empty.nii", "");
        write_file(folder / "noise.dcm", std::string(300, 'x'));
        std::filesystem::create_directory(folder / "nothing");
        good_ = {scan, folder / "other.nrrd", folder / "large.nrrd"};
        bad_ = {folder / "cut.nrrd", folder / "empty.nii", folder / "noise.dcm", folder / "nothing",
                folder / "missing"};
    }

    int any(int n) { return static_cast<int>(random_() % static_cast<unsigned>(n)); }
    template <class T>
    T one_of(const std::vector<T>& all) {
        return all[static_cast<std::size_t>(any(static_cast<int>(all.size())))];
    }
    QPoint any_point(const QWidget* widget) { return {any(widget->width()), any(widget->height())}; }
    QWidget* widget() {
        return one_of<QWidget*>({view(), window->slice_view(Plane::axial), window->slice_view(Plane::coronal),
                                 window->slice_view(Plane::sagittal), window->histogram_bar()});
    }
    Qt::MouseButton button() {
        return one_of<Qt::MouseButton>({Qt::LeftButton, Qt::MiddleButton, Qt::RightButton});
    }

    void drag_anything() {
        QWidget* on = widget();
        move(on, button(), any_point(on), any_point(on), any(10) > 0);
    }

    // Where the 3D view draws a position, which may be behind the camera.
    QPoint point_of(const Vec3d& position) {
        return view()->widget_point(position).value_or(QPointF(any_point(view()))).toPoint();
    }

    void drag_a_side_of_the_crop_box() {
        key(Qt::Key_K);
        viewer::SliceView* slice = window->slice_view(Plane(any(3)));
        Vec3d corner;
        for (std::size_t a = 0; a < 3; ++a) corner[a] = viewer::border_of(session().crop(), {a, any(2) > 0});
        move(slice, Qt::LeftButton, slice->widget_point(corner).toPoint(), any_point(slice), true);
        const viewer::CropSide side{static_cast<std::size_t>(any(3)), any(2) > 0};
        const Vec3d handle = viewer::CropBox::handle(session().crop(), side);
        move(view(), Qt::LeftButton, point_of(session().scan()->volume.geometry().physical(handle)),
             any_point(view()), any(10) > 0);
    }

    // Without a release, the next events arrive while the button is still down.
    static void move(QWidget* on, Qt::MouseButton with, QPoint from, QPoint to, bool release) {
        QTest::mousePress(on, with, Qt::NoModifier, from);
        for (int i = 1; i <= 3; ++i) {
            QMouseEvent move(QEvent::MouseMove, from + (to - from) * i / 3, Qt::NoButton, with,
                             Qt::NoModifier);
            QApplication::sendEvent(on, &move);
        }
        if (release) QTest::mouseRelease(on, with, Qt::NoModifier, to);
    }

    void turn_the_wheel() {
        QWidget* on = widget();
        QWheelEvent wheel(any_point(on), on->mapToGlobal(QPoint(5, 5)), QPoint(),
                          QPoint(0, any(2) ? 120 : -120), Qt::NoButton,
                          any(3) ? Qt::NoModifier : Qt::ControlModifier, Qt::NoScrollPhase, false);
        QApplication::sendEvent(on, &wheel);
    }

    // Sometimes interferes while the scan is loading.
    void open_something() {
        window->open(one_of(any(2) ? good_ : bad_));
        const int until = any(4);
        for (int i = 0; i < until; ++i) QTest::qWait(any(4));
        switch (any(5)) {
            case 0:
                key(Qt::Key_Escape);
                break;
            case 1:
                window->findChild<QToolButton*>("cancel")->click();
                break;
            case 2:
                window->open(one_of(good_));
                break;
            default:
                break;
        }
    }

    // Closes the window, even if it is busy, and opens a new one.
    void close_and_reopen() {
        if (any(2)) window->open(one_of(good_));
        if (any(2)) session().set_isovalue(any(1000) - 500);
        window->close();
        window = std::make_unique<viewer::MainWindow>();
        window->show();
        if (any(2)) QTest::qWait(any(50));
        ASSERT_TRUE(open(scan));
    }

    void change_surfaces() {
        const auto& surfaces = session().parameters().surfaces;
        if (surfaces.size() < 4)
            session().add_surface("s", session().current()->isovalue + any(200) - 100, {},
                                  0.2 + 0.2 * any(5));
        else
            session().remove_surface(surfaces[static_cast<std::size_t>(any(4))].id);
    }

    void arrange_views() {
        switch (any(3)) {
            case 0:
                return QTest::mouseDClick(widget(), button(), Qt::NoModifier, any_point(widget()));
            case 1:
                return window->views()->set_layout_choice(any(2) ? viewer::Layout::column
                                                                 : viewer::Layout::square);
            default:
                return window->views()->set_slab(
                    {any(2) ? viewer::Slab::Mode::maximum : viewer::Slab::Mode::mean, 5.0 * any(4)});
        }
    }

    void measure_and_drag_an_end() {
        key(any(2) ? Qt::Key_D : Qt::Key_A);
        viewer::SliceView* slice = window->slice_view(Plane(any(3)));
        for (int i = 0; i < 3; ++i)
            QTest::mouseClick(slice, Qt::LeftButton, Qt::NoModifier, any_point(slice));
        const auto& measurements = session().parameters().measurements;
        if (measurements.empty()) return;
        const Vec3d end = measurements.back().points.front();
        const Vec3d index = viewer::index_of(session().scan()->volume.geometry(), end);
        any(2)
            ? move(slice, Qt::LeftButton, slice->widget_point(index).toPoint(), any_point(slice), any(10) > 0)
            : move(view(), Qt::LeftButton, point_of(end), any_point(view()), any(10) > 0);
    }

    void export_something() {
        const int id = session().parameters().current;
        if (window->busy() || !window->surfaces().exact(id)) return;
        window->write({{id, folder / one_of<std::string>({"a.stl", "a.ply", "a.3mf", "no/where.stl"})}},
                      Space::LPS);
        if (any(3) == 0) window->findChild<QToolButton*>("cancel")->click();
    }

    // What was changed while a scan was loading may be lost.
    void answer_questions() {
        for (auto* box : window->findChildren<QMessageBox*>("discard_box"))
            if (box->isVisible()) box->button(any(2) ? QMessageBox::Discard : QMessageBox::Cancel)->click();
    }

    void something() {
        static const std::vector<int> keys{Qt::Key_W, Qt::Key_S,      Qt::Key_R,   Qt::Key_1, Qt::Key_2,
                                           Qt::Key_3, Qt::Key_4,      Qt::Key_5,   Qt::Key_6, Qt::Key_C,
                                           Qt::Key_F, Qt::Key_D,      Qt::Key_A,   Qt::Key_N, Qt::Key_T,
                                           Qt::Key_X, Qt::Key_Escape, Qt::Key_Tab, Qt::Key_B, Qt::Key_K};
        answer_questions();
        switch (any(17)) {
            case 0:
            case 1: {
                QWidget* on = widget();
                return QTest::mouseClick(on, button(), any(4) ? Qt::NoModifier : Qt::ShiftModifier,
                                         any_point(on));
            }
            case 2:
            case 3:
                return drag_anything();
            case 4:
                return turn_the_wheel();
            case 5:
            case 6:
                return key(one_of(keys));
            case 7:
                return key(Qt::Key_Z, any(2) ? Qt::ControlModifier : Qt::ControlModifier | Qt::ShiftModifier);
            case 8:
                return QTest::keyClick(widget(), one_of<Qt::Key>({Qt::Key_Left, Qt::Key_Right, Qt::Key_PageUp,
                                                                  Qt::Key_PageDown}));
            case 9: {
                const auto chips = window->findChildren<QPushButton*>("chip");
                return QTest::mouseClick(chips[any(static_cast<int>(chips.size()))], Qt::LeftButton);
            }
            case 10:
                return window->findChild<QCheckBox*>(one_of<QString>({"largest", "open", "topology"}))
                    ->click();
            case 11:
            case 12:
                return drag_a_side_of_the_crop_box();
            case 13:
                return export_something();
            case 14:
                return arrange_views();
            case 15:
                return measure_and_drag_an_end();
            default:
                break;
        }
        // Slow events are less frequent, because OpenGL may run on the processor.
        switch (any(24)) {
            case 0:
            case 1:
            case 2:
            case 3:
            case 4:
                return change_surfaces();
            case 5:
            case 6:
            case 7:
            case 8:
            case 9:
            case 10:
            case 11:
                return open_something();
            case 12:
                return close_and_reopen();
            default:
                return window->resize(700 + any(700), 500 + any(500));
        }
    }

    std::vector<std::filesystem::path> good_, bad_;
    std::mt19937 random_{20260719};
};

// In the end, the viewer still shows the requested surfaces.
TEST_F(RandomEvents, SurvivesTwoThousand) {
    for (int event = 0; event < 2000; ++event) {
        something();
        if (HasFatalFailure()) return;
        if (any(12) == 0) QApplication::processEvents();
        ASSERT_TRUE(session().current());
        const viewer::SampleBox box = session().crop(), whole = session().whole_scan();
        for (std::size_t a = 0; a < 3; ++a) {
            ASSERT_GE(session().crosshair()[a], 0);
            ASSERT_LE(session().crosshair()[a], static_cast<double>(whole.last[a]));
            ASSERT_GE(box.first[a], 0);
            ASSERT_LT(box.first[a], box.last[a]);
            ASSERT_LE(box.last[a], whole.last[a]);
        }
    }
    QAction* turntable = window->findChild<QAction*>("turntable");
    if (turntable->isChecked()) turntable->trigger();
    ASSERT_TRUE(settle());
    const Parameters& p = session().parameters();
    const viewer::SampleBox box = session().crop();
    const Volume cropped = crop(session().scan()->volume, box.first, box.last);
    for (const viewer::SurfaceParameters& surface : p.surfaces) {
        const auto shape = window->surfaces().exact(surface.id);
        ASSERT_TRUE(shape);
        Mesh expected =
            extract_isosurface(cropped, surface.isovalue, {.closed = !p.open, .topology = p.topology});
        if (p.largest) expected = keep_components(expected, {.count = 1, .cavities = false});
        EXPECT_EQ(shape->mesh->points, expected.points);
        EXPECT_EQ(shape->mesh->triangles, expected.triangles);
    }
}

}  // namespace
}  // namespace marrow::test
