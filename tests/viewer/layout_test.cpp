// Tests that the window fits on small screens and that all of it can be reached there.
#include <QMenu>
#include <QScreen>
#include <QTimer>
#include <QToolBar>

#include "support/viewer_ball.h"

namespace marrow::test {
namespace {

TEST_F(BallViewer, FitsOnASmallScreen) {
    window->resize(800, 500);  // also 1600 x 1000 at twice the scale
    const auto visible = [&](QWidget* widget) {
        return widget->isVisible() && widget->visibleRegion().boundingRect() == widget->rect();
    };
    // The new size takes effect when the display confirms it. The histogram is below the others.
    EXPECT_TRUE(wait([&] { return window->size() == QSize(800, 500) && visible(window->histogram_bar()); }));
    EXPECT_TRUE(visible(view()));
    for (const auto plane : {viewer::Plane::axial, viewer::Plane::coronal, viewer::Plane::sagittal})
        EXPECT_TRUE(visible(window->slice_view(plane))) << static_cast<int>(plane);
    EXPECT_FALSE(window->findChild<QWidget*>("welcome")->isVisible());  // it showed through
}

// What the tool bar has no room for is in a menu, so that nothing ever covers the views. Export stays.
TEST_F(BallViewer, ANarrowWindowHasAMenuOfMoreTools) {
    auto* more = window->findChild<QToolButton*>("qt_toolbar_ext_button");
    auto* turn = window->findChild<QToolButton*>("turntable_button");
    window->resize(1600, 900);
    ASSERT_TRUE(wait([&] { return turn->isVisible() && !more->isVisible(); }));
    window->resize(800, 600);
    ASSERT_TRUE(wait([&] { return !turn->isVisible() && more->isVisible(); }));
    EXPECT_FALSE(more->text().isEmpty());
    EXPECT_TRUE(window->findChild<QToolButton*>("export")->isVisible());
    const QRect views = window->views()->geometry();
    QTimer::singleShot(100, [] { QApplication::activePopupWidget()->close(); });
    QTest::mouseClick(more, Qt::LeftButton);
    EXPECT_EQ(window->views()->geometry(), views);
    const auto offers = [&](const char* name) {
        return more->menu()->actions().contains(window->findChild<QAction*>(name));
    };
    EXPECT_TRUE(offers("turntable"));
    EXPECT_TRUE(offers("wireframe"));
    EXPECT_FALSE(offers("distance")) << "the tool bar shows it";
    window->findChild<QAction*>("wireframe")->trigger();
    EXPECT_EQ(session().parameters().mode, viewer::DrawMode::wireframe);
}

// The window manager's frame needs room too: without it, the status bar was below the screen.
TEST_F(ViewerTest, TheFirstSizeFitsTheScreen) {
    const viewer::MainWindow fresh;
    const QSize screen = fresh.screen()->availableSize();
    EXPECT_EQ(fresh.size(), QSize(1440, 900).boundedTo(screen - QSize(16, 48)));
}

TEST_F(ViewerTest, FullScreenIsRemembered) {
    window->findChild<QAction*>("full_screen")->trigger();
    ASSERT_TRUE(wait([&] { return window->isFullScreen(); }));
    window->close();
    window = std::make_unique<viewer::MainWindow>();
    window->show();
    EXPECT_TRUE(window->isFullScreen());
    auto* full_screen = window->findChild<QAction*>("full_screen");
    EXPECT_TRUE(full_screen->isChecked());
    full_screen->trigger();
    EXPECT_FALSE(window->isFullScreen());
    window->setWindowState(Qt::WindowFullScreen);  // as a window manager does
    EXPECT_TRUE(full_screen->isChecked());
}

}  // namespace
}  // namespace marrow::test
