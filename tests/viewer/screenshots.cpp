// Drives the viewer like a user and takes the screenshots of docs/viewer.md.
// usage: viewer_screenshots SCAN FOLDER [SERIES]
//        SCAN: the head CT that scripts/demo unpacks; SERIES: a folder with several series
#include <cstdio>
#include <cstdlib>
#include <stdexcept>

#include <vtkObject.h>
#include <QApplication>
#include <QDir>
#include <QPainter>
#include <QSettings>
#include <QStatusBar>
#include <QSurfaceFormat>
#include <QTableWidget>
#include <QTemporaryDir>
#include <QTest>

#include "window/main_window.h"
#include "window/theme.h"

using namespace marrow;
using viewer::Plane;

namespace {

constexpr int kPatience = 120000;  // ms

class Photographer {
  public:
    Photographer(viewer::MainWindow& window, QString folder) : window_(window), folder_(std::move(folder)) {}

    viewer::MainWindow& window() { return window_; }

    void settle() {
        const bool done = QTest::qWaitFor(
            [&] {
                return !window_.busy() && window_.surfaces().settled() && !window_.surface_view()->stale();
            },
            kPatience);
        if (!done) throw std::runtime_error("the viewer does not become idle");
        QTest::qWait(200);
    }

    void key(Qt::Key key, Qt::KeyboardModifiers modifiers = Qt::NoModifier) {
        QApplication::setActiveWindow(&window_);
        QTest::keyClick(&window_, key, modifiers);
    }

    void click(QWidget* widget, const QPointF& point) {
        QTest::mouseClick(widget, Qt::LeftButton, Qt::NoModifier, point.toPoint());
    }

    void drag(QWidget* widget, QPoint from, QPoint to, Qt::MouseButton button = Qt::LeftButton) {
        QTest::mousePress(widget, button, Qt::NoModifier, from);
        for (int i = 1; i <= 6; ++i) {
            QMouseEvent move(QEvent::MouseMove, from + (to - from) * i / 6, Qt::NoButton, button,
                             Qt::NoModifier);
            QApplication::sendEvent(widget, &move);
        }
        QTest::mouseRelease(widget, button, Qt::NoModifier, to);
    }

    void click_slice(Plane plane, const Vec3d& index) {
        click(window_.slice_view(plane), window_.slice_view(plane)->widget_point(index));
    }

    void drag_slice(Plane plane, const Vec3d& from, const Vec3d& to) {
        viewer::SliceView* slice = window_.slice_view(plane);
        drag(slice, slice->widget_point(from).toPoint(), slice->widget_point(to).toPoint());
    }

    void turn_wheel(int steps) {
        viewer::SurfaceView* view = window_.surface_view();
        const QPoint centre = view->rect().center();
        for (int i = 0; i < std::abs(steps); ++i) {
            QWheelEvent event(centre, view->mapToGlobal(centre), QPoint(), QPoint(0, steps > 0 ? 120 : -120),
                              Qt::NoButton, Qt::NoModifier, Qt::NoScrollPhase, false);
            QApplication::sendEvent(view, &event);
        }
    }

    /// Saves the window, and above it the dialog if there is one.
    void take(const QString& name, QWidget* dialog = nullptr) {
        settle();
        window_.statusBar()->clearMessage();
        QImage image = window_.grab().toImage();
        if (dialog) {
            QPainter painter(&image);
            painter.fillRect(image.rect(), QColor(0, 0, 0, 110));
            const QPixmap over = dialog->grab();
            painter.drawPixmap((image.width() - over.width()) / 2, (image.height() - over.height()) / 2,
                               over);
        }
        const QString file = QDir(folder_).filePath(name + ".png");
        if (!image.save(file)) throw std::runtime_error("cannot write " + file.toStdString());
        std::printf("%s\n", file.toUtf8().constData());
    }

  private:
    viewer::MainWindow& window_;
    QString folder_;
};

void open_scan(Photographer& camera, const char* scan) {
    viewer::MainWindow& window = camera.window();
    window.open(scan);
    (void)QTest::qWaitFor([&] { return window.session().scan() != nullptr; }, kPatience);
    if (!window.session().scan()) throw std::runtime_error(window.banner().toStdString());
    camera.settle();
}

void take_window(Photographer& camera) {
    camera.window().findChild<QCheckBox*>("largest")->click();
    camera.key(Qt::Key_R);
    camera.click_slice(Plane::axial, {139, 150, 30});
    camera.click_slice(Plane::coronal, {139, 150, 34});
    camera.key(Qt::Key_X);
    camera.take("window");
}

// Bone in translucent skin, without and with a cut.
void take_skin_and_cut(Photographer& camera) {
    viewer::Session& session = camera.window().session();
    viewer::SurfaceView* view = camera.window().surface_view();
    session.add_surface("skin", -300, QColor::fromRgbF(0.93, 0.72, 0.60), 0.22);
    session.apply_preset("skin");
    camera.settle();
    camera.key(Qt::Key_R);
    camera.take("skin");

    session.select_surface(session.parameters().surfaces[0].id);
    camera.click_slice(Plane::coronal, {124, 150, 34});
    for (int i = 0; i < 3; ++i) camera.key(Qt::Key_C);
    camera.key(Qt::Key_3);
    camera.drag(view, view->rect().center(), view->rect().center() + QPoint(60, 20));
    camera.take("cut");
    camera.key(Qt::Key_C);
    session.remove_surface(session.parameters().surfaces[1].id);
}

// The bone of the face, where walls are thin.
void take_trust(Photographer& camera) {
    viewer::Session& session = camera.window().session();
    session.change("colouring", {}, [](viewer::Parameters& p) { p.colouring = viewer::Colouring::shift; });
    camera.key(Qt::Key_1);
    camera.turn_wheel(4);
    camera.take("trust");
    session.change("colouring", {}, [](viewer::Parameters& p) { p.colouring = viewer::Colouring::own; });
}

void take_measurements(Photographer& camera) {
    viewer::SurfaceView* view = camera.window().surface_view();
    camera.key(Qt::Key_1);
    camera.key(Qt::Key_D);
    camera.settle();
    for (const double x : {0.38, 0.62}) camera.click(view, QPointF(x * view->width(), 0.56 * view->height()));
    camera.key(Qt::Key_N);
    camera.click_slice(Plane::axial, {124, 128, 60});
    camera.key(Qt::Key_D);
    const double k = camera.window().session().crosshair()[2];
    camera.click_slice(Plane::axial, {69, 128, k});
    camera.click_slice(Plane::axial, {180, 128, k});
    camera.key(Qt::Key_A);
    for (const Vec3d& p : {Vec3d{80, 128, 60}, Vec3d{124, 128, 95}, Vec3d{170, 128, 60}})
        camera.click_slice(Plane::coronal, p);
    camera.key(Qt::Key_N);
    camera.take("measure");
    for (int i = 0; i < 3; ++i) camera.key(Qt::Key_Z, Qt::ControlModifier);
}

// Crops to the upper half of the right side of the head.
void take_crop(Photographer& camera) {
    camera.key(Qt::Key_R);
    camera.key(Qt::Key_K);
    camera.turn_wheel(-4);
    camera.click_slice(Plane::axial, {124, 128, 60});
    camera.drag_slice(Plane::coronal, {60, 128, -0.5}, {60, 128, 44.5});
    camera.drag_slice(Plane::axial, {255.5, 60, 60}, {139.5, 60, 60});
    camera.take("crop");
    camera.key(Qt::Key_N);
    camera.window().findChild<QAction*>("whole_scan")->trigger();
}

void take_edges(Photographer& camera) {
    camera.key(Qt::Key_R);
    camera.key(Qt::Key_W);
    camera.turn_wheel(9);
    camera.take("edges");
    camera.key(Qt::Key_S);
    camera.key(Qt::Key_R);
}

// Four views, with a slab of the slices and a measurement on it.
void take_four_views(Photographer& camera) {
    viewer::ViewLayout* views = camera.window().views();
    views->set_layout_choice(viewer::Layout::square);
    views->set_slab({viewer::Slab::Mode::maximum, 10});
    camera.settle();
    camera.click_slice(Plane::axial, {124, 90, 34});
    camera.key(Qt::Key_D);
    for (const double x : {69.0, 179.0}) camera.click_slice(Plane::coronal, {x, 90, 60});
    camera.key(Qt::Key_N);
    camera.take("views");
    camera.key(Qt::Key_Z, Qt::ControlModifier);
    views->set_slab({});
    views->set_layout_choice(viewer::Layout::column);
}

void take_export_dialog(Photographer& camera) {
    camera.settle();
    camera.key(Qt::Key_S, Qt::ControlModifier);
    auto* dialog = camera.window().findChild<viewer::ExportDialog*>("export_dialog");
    dialog->set_file("/home/me/skull.stl");
    camera.take("export", dialog);
    dialog->reject();
}

void take_series_dialog(Photographer& camera, const char* folder) {
    camera.window().open(folder);
    const auto pictures_are_there = [&] {
        auto* table = camera.window().findChild<QTableWidget*>("series");
        if (!table) return false;
        for (int row = 0; row < table->rowCount(); ++row) {
            if (table->item(row, 0)->icon().isNull()) return false;
        }
        return true;
    };
    if (!QTest::qWaitFor(pictures_are_there, kPatience)) throw std::runtime_error("no pictures of series");
    auto* dialog = camera.window().findChild<QDialog*>("series_dialog");
    camera.take("series", dialog);
    dialog->reject();
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 3 && argc != 4) {
        std::fprintf(stderr, "usage: viewer_screenshots SCAN FOLDER [SERIES]\n");
        return 2;
    }
    QTemporaryDir settings;
    QSettings::setPath(QSettings::NativeFormat, QSettings::UserScope, settings.path());
    QSurfaceFormat format = QVTKOpenGLNativeWidget::defaultFormat();
    format.setSamples(0);
    QSurfaceFormat::setDefaultFormat(format);
    vtkObject::GlobalWarningDisplayOff();
    QApplication application(argc, argv);
    QApplication::setOrganizationName("marrow-screenshots");
    viewer::apply_theme(application);
    QDir().mkpath(argv[2]);
    viewer::MainWindow window;
    window.resize(1440, 900);
    window.show();
    try {
        (void)QTest::qWaitForWindowExposed(&window, kPatience);
        window.grab().save(QDir(argv[2]).filePath("welcome.png"));
        Photographer camera(window, argv[2]);
        open_scan(camera, argv[1]);
        take_window(camera);
        take_skin_and_cut(camera);
        take_trust(camera);
        take_measurements(camera);
        take_crop(camera);
        take_edges(camera);
        take_four_views(camera);
        take_export_dialog(camera);
        if (argc == 4) take_series_dialog(camera, argv[3]);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "viewer_screenshots: %s\n", error.what());
        return 1;
    }
    return 0;
}
