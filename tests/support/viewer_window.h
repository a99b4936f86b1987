/// A test fixture: a window that is driven like a user would.
#pragma once

#include <cstdlib>

#include <gtest/gtest.h>
#include <vtkObject.h>
#include <QApplication>
#include <QSettings>
#include <QSurfaceFormat>
#include <QTest>

#include "command_line.h"
#include "window/main_window.h"
#include "window/theme.h"

namespace marrow::test {

/// The only application of the process, with empty settings.
inline QApplication& application() {
    static int argc = 1;
    static char name[] = "viewer_test";
    static char* argv[] = {name, nullptr};
    static QApplication* instance = [] {
        static const TemporaryFolder settings;
        QSettings::setPath(QSettings::NativeFormat, QSettings::UserScope, settings.path().c_str());
        QSurfaceFormat format = QVTKOpenGLNativeWidget::defaultFormat();
        format.setSamples(0);
        QSurfaceFormat::setDefaultFormat(format);
        vtkObject::GlobalWarningDisplayOff();
        auto* made = new QApplication(argc, argv);
        QApplication::setOrganizationName("marrow-test");
        QApplication::setApplicationName("viewer");
        viewer::apply_theme(*made);
        return made;
    }();
    return *instance;
}

class ViewerTest : public ::testing::Test {
  protected:
    static constexpr int kPatience = 60000;  // ms; drawing without a graphics card is slow

    void SetUp() override {
        if (!std::getenv("DISPLAY")) GTEST_SKIP() << "no display";
        application();
        QSettings().clear();  // those of other tests
        window = std::make_unique<viewer::MainWindow>();
        window->resize(1200, 800);
        window->show();
        ASSERT_TRUE(QTest::qWaitForWindowExposed(window.get(), kPatience));
    }

    template <class Condition>
    static bool wait(Condition condition) {
        return QTest::qWaitFor(condition, kPatience);
    }

    viewer::SurfaceView* view() { return window->surface_view(); }
    viewer::Session& session() { return window->session(); }

    /// Waits until everything requested is extracted and drawn.
    bool settle() {
        return wait([&] { return !window->busy() && window->surfaces().settled() && !view()->stale(); });
    }

    bool open(const std::filesystem::path& input) {
        const viewer::Scan* before = session().scan();
        window->open(input);
        return wait([&] { return !window->busy(); }) && session().scan() != before && settle();
    }

    void key(int key, Qt::KeyboardModifiers modifiers = Qt::NoModifier) {
        QApplication::setActiveWindow(window.get());  // there may be no window manager that does so
        QTest::keyClick(window.get(), Qt::Key(key), modifiers);
    }

    /// Presses at one point of a widget, moves, and releases at another point.
    static void drag(QWidget* widget, QPoint from, QPoint to, Qt::MouseButton button = Qt::LeftButton,
                     int moves = 8) {
        QTest::mousePress(widget, button, Qt::NoModifier, from);
        for (int i = 1; i <= moves; ++i) {
            const QPoint point = from + (to - from) * i / moves;
            QMouseEvent move(QEvent::MouseMove, point, widget->mapToGlobal(point), Qt::NoButton, button,
                             Qt::NoModifier);
            QApplication::sendEvent(widget, &move);
            QTest::qWait(5);
        }
        QTest::mouseRelease(widget, button, Qt::NoModifier, to);
    }

    void click_on_slice(viewer::Plane plane, const Vec3d& index) {
        viewer::SliceView* slice = window->slice_view(plane);
        QTest::mouseClick(slice, Qt::LeftButton, Qt::NoModifier, slice->widget_point(index).toPoint());
    }

    /// The image in the 3D view.
    QImage picture() {
        EXPECT_TRUE(settle());
        QTest::qWait(30);
        return view()->grabFramebuffer().convertToFormat(QImage::Format_RGB32);
    }

    template <class Is>
    static int count(const QImage& image, Is is) {
        int n = 0;
        for (int y = 0; y < image.height(); ++y) {
            const auto* line = reinterpret_cast<const QRgb*>(image.constScanLine(y));
            for (int x = 0; x < image.width(); ++x) n += is(line[x]);
        }
        return n;
    }

    /// Whether a pixel has the warm colours of bone and skin. The background is bluish.
    static bool warm(QRgb c) { return qRed(c) > qBlue(c) + 6 && qRed(c) > 30; }

    TemporaryFolder folder;
    std::unique_ptr<viewer::MainWindow> window;
};

}  // namespace marrow::test
