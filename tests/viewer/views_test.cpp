// Tests how the views are arranged, and windows, values, slabs and measurements in them.
#include <numeric>
#include <random>

#include "support/viewer_ball.h"
#include "views/scene_parts.h"
#include "views/slice_geometry.h"
#include "views/window_presets.h"

namespace marrow::test {
namespace {

using viewer::Layout;
using viewer::Plane;
using viewer::Slab;

constexpr std::array kPlanes{Plane::axial, Plane::coronal, Plane::sagittal};

class Views : public BallViewer {
  protected:
    viewer::SliceView* slice(Plane plane) { return window->slice_view(plane); }
    viewer::ViewLayout* views() { return window->views(); }

    /// Moves the mouse without a button, or with one that is already pressed.
    static void move(QWidget* widget, const QPoint& point, Qt::MouseButtons buttons = Qt::NoButton) {
        QMouseEvent event(QEvent::MouseMove, point, widget->mapToGlobal(point), Qt::NoButton, buttons,
                          Qt::NoModifier);
        QApplication::sendEvent(widget, &event);
    }

    static void turn_wheel(QWidget* widget, const QPoint& at, int steps) {
        QWheelEvent event(at, widget->mapToGlobal(at), {}, {0, 120 * steps}, Qt::NoButton,
                          Qt::ControlModifier, Qt::NoScrollPhase, false);
        QApplication::sendEvent(widget, &event);
    }

    static void double_click(QWidget* widget, const QPoint& point) {
        QTest::mouseClick(widget, Qt::LeftButton, Qt::NoModifier, point);
        QTest::mouseDClick(widget, Qt::LeftButton, Qt::NoModifier, point);
    }

    /// Writes a cube of float samples that are this far apart, mm.
    template <class F>
    void write_floats(const std::string& name, int side, const std::string& mm, const F& value) {
        std::vector<float> samples;
        for (int z = 0; z < side; ++z) {
            for (int y = 0; y < side; ++y) {
                for (int x = 0; x < side; ++x) samples.push_back(static_cast<float>(value(x, y, z)));
            }
        }
        const std::string s = std::to_string(side);
        write_file(folder / name,
                   "NRRD0004\ntype: float\ndimension: 3\nsizes: " + s + " " + s + " " + s +
                       "\nspacings: " + mm + " " + mm + " " + mm + "\nendian: little\nencoding: raw\n\n" +
                       std::string(reinterpret_cast<const char*>(samples.data()), 4 * samples.size()));
    }

    QAction* action(const char* name) { return window->findChild<QAction*>(name); }

    std::vector<QWidget*> visible_views() {
        std::vector<QWidget*> result;
        if (view()->isVisible()) result.push_back(view());
        for (const Plane plane : kPlanes) {
            if (slice(plane)->isVisible()) result.push_back(slice(plane));
        }
        return result;
    }
};

TEST(Window, IsWrittenAsOnWorkstations) {
    EXPECT_EQ(viewer::window_text({300, 1500}), "W 1500 L 300");
    EXPECT_EQ(viewer::window_text({-600.4, 1499.6}), "W 1500 L -600");
    EXPECT_EQ(viewer::window_text({0.25, 0.5}), "W 0.5 L 0.25");
}

TEST_F(Views, ThePresetsOfTheWindowAreTicked) {
    EXPECT_EQ(action("window_bone")->text(), "Bone: W 1500 L 300");
    EXPECT_TRUE(action("window_bone")->isChecked());
    action("window_lung")->trigger();
    EXPECT_TRUE(session().parameters().window == (viewer::Window{-600, 1500}));
    EXPECT_TRUE(action("window_lung")->isChecked());
    EXPECT_FALSE(action("window_bone")->isChecked());
    action("window_lung")->trigger();  // again: stays ticked
    EXPECT_TRUE(action("window_lung")->isChecked());
    const QPoint middle = slice(Plane::axial)->rect().center();
    drag(slice(Plane::axial), middle, middle + QPoint(20, 5), Qt::RightButton);
    EXPECT_FALSE(action("window_lung")->isChecked());
    key(Qt::Key_Z, Qt::ControlModifier);
    EXPECT_TRUE(action("window_lung")->isChecked());
}

TEST_F(Views, ShowWholeNumbersWithAllTheirDigits) {
    std::vector<std::uint32_t> samples(4 * 5 * 6, 312782546);
    samples.front() = 1;
    write_file(folder / "atlas.nrrd",
               "NRRD0004\ntype: uint32\ndimension: 3\nsizes: 4 5 6\nspacings: 1 1 1\nendian: "
               "little\nencoding: raw\n\n" +
                   std::string(reinterpret_cast<const char*>(samples.data()), 4 * samples.size()));
    ASSERT_TRUE(open(folder / "atlas.nrrd"));
    for (const Plane plane : kPlanes) EXPECT_EQ(slice(plane)->readout(), "312782546");
}

TEST_F(Views, AScanOfMicrometresIsShownAsLargeAsOneOfMillimetres) {
    const auto picture_of = [&](const std::string& spacing, bool reset) {
        const auto middle = [](double x, double y, double z) {
            return 15 - std::hypot(x - 20, y - 20, z - 20);
        };
        write_floats("ball" + spacing + ".nrrd", 40, spacing, middle);
        EXPECT_TRUE(open(folder / ("ball" + spacing + ".nrrd")));
        if (reset) key(Qt::Key_R);
        return picture();
    };
    for (const bool reset : {false, true}) {
        const QImage large = picture_of("1", reset), small = picture_of("0.0003", reset);
        ASSERT_EQ(large.size(), small.size());
        int different = 0;
        for (int y = 0; y < large.height(); ++y) {
            for (int x = 0; x < large.width(); ++x)
                different += std::abs(qGreen(large.pixel(x, y)) - qGreen(small.pixel(x, y))) > 30;
        }
        EXPECT_LT(different, large.width() * large.height() / 100) << reset;
    }
}

// Such as diffusion in m^2/s.
TEST_F(Views, TheWindowOfTinyValuesCanBeChanged) {
    write_floats("tiny.nrrd", 20, "1",
                 [](int x, int y, int z) { return 3e-14 * ((400 * z + 20 * y + x) * 7919 % 1000) / 1000; });
    ASSERT_TRUE(open(folder / "tiny.nrrd"));
    const auto width = [&] { return session().parameters().window.width; };
    const auto contrast = [&] {
        const QImage image = slice(Plane::axial)->grab().toImage();
        int least = 255, most = 0;
        for (int y = image.height() / 4; y < 3 * image.height() / 4; ++y) {
            for (int x = image.width() / 3; x < 2 * image.width() / 3; ++x) {
                const QRgb c = image.pixel(x, y);
                if (qRed(c) != qGreen(c) || qGreen(c) != qBlue(c)) continue;
                least = std::min(least, qRed(c));
                most = std::max(most, qRed(c));
            }
        }
        return most - least;
    };
    const viewer::Window all = viewer::window_of_all_values(session().scan()->histogram);
    EXPECT_LT(all.width, 3.1e-14);
    action("window_full")->trigger();
    EXPECT_EQ(width(), all.width);
    EXPECT_TRUE(action("window_full")->isChecked());
    EXPECT_GT(contrast(), 150);
    drag(slice(Plane::axial), {50, 50}, {65, 50}, Qt::RightButton);
    EXPECT_NEAR(width() / all.width, std::exp(0.1), 1e-6);
    EXPECT_GT(contrast(), 150);
    // However far it is narrowed, another drag widens it again.
    for (int i = 0; i < 20; ++i) drag(slice(Plane::axial), {255, 50}, {5, 50}, Qt::RightButton, 1);
    const double narrowest = width();
    EXPECT_LT(narrowest, 1e-6 * all.width);
    drag(slice(Plane::axial), {50, 50}, {200, 50}, Qt::RightButton);
    EXPECT_NEAR(width() / narrowest, std::exp(1), 1e-6);
}

TEST_F(Views, AFineWheelMovesTheSlicesByWholeSteps) {
    viewer::SliceView* axial = slice(Plane::axial);
    const double before = session().crosshair()[2];
    const QPoint at = axial->rect().center();
    for (const double expected : {0, 0, 1, 1, 1, 2}) {
        QWheelEvent event(at, axial->mapToGlobal(at), {}, {0, 40}, Qt::NoButton, Qt::NoModifier,
                          Qt::NoScrollPhase, false);
        QApplication::sendEvent(axial, &event);
        EXPECT_EQ(std::abs(session().crosshair()[2] - before), expected);
    }
}

TEST_F(Views, ShowTheValueUnderThePointerAndTheWindowWhileItIsDragged) {
    viewer::SliceView* axial = slice(Plane::axial);
    EXPECT_EQ(axial->readout(), "905 HU");  // at the crosshair, {23, 23, 12}
    const QPoint at = axial->widget_point({24, 22, 12}).toPoint();
    move(axial, at);
    EXPECT_EQ(axial->readout(), "1000 HU  (24, 22, 12)");
    move(axial, axial->widget_point({24, 29, 12}).toPoint());
    EXPECT_EQ(axial->readout(), QString("%1 HU  (24, 29, 12)").arg(1000 * 8 / 15));
    move(axial, axial->widget_point({-5, 22, 12}).toPoint());
    EXPECT_EQ(axial->readout(), "");  // beside the scan
    QEvent leave(QEvent::Leave);
    QApplication::sendEvent(axial, &leave);
    EXPECT_EQ(axial->readout(), "905 HU");

    QTest::mousePress(axial, Qt::RightButton, Qt::NoModifier, at);
    EXPECT_EQ(axial->readout(), "W 1500 L 300");
    move(axial, at + QPoint(30, 0), Qt::RightButton);
    EXPECT_EQ(axial->readout(), viewer::window_text(session().parameters().window));
    EXPECT_NE(axial->readout(), "W 1500 L 300");
    QTest::mouseRelease(axial, Qt::RightButton, Qt::NoModifier, at + QPoint(30, 0));
    EXPECT_FALSE(axial->readout().startsWith("W"));
}

TEST_F(Views, SlicesZoomTogether) {
    const auto scale = [&](Plane plane) {
        const QPointF step = slice(plane)->widget_point({10, 10, 10}) - slice(plane)->widget_point({9, 9, 9});
        return std::hypot(step.x(), step.y());
    };
    std::array<double, 3> before;
    std::array<QPointF, 3> crosshair;
    for (const Plane plane : kPlanes) {
        before[static_cast<std::size_t>(plane)] = scale(plane);
        crosshair[static_cast<std::size_t>(plane)] = slice(plane)->widget_point(session().crosshair());
    }
    const QPoint pointer = slice(Plane::axial)->widget_point({30, 12, 12}).toPoint();
    turn_wheel(slice(Plane::axial), pointer, 4);
    for (const Plane plane : kPlanes) {
        EXPECT_NEAR(scale(plane), std::pow(1.2, 4) * before[static_cast<std::size_t>(plane)], 1e-6);
        if (plane == Plane::axial) continue;
        const QPointF moved =
            slice(plane)->widget_point(session().crosshair()) - crosshair[static_cast<std::size_t>(plane)];
        EXPECT_LT(moved.manhattanLength(), 1e-6);
    }
    const QPointF under = slice(Plane::axial)->widget_point({30, 12, 12}) - pointer;
    EXPECT_LT(under.manhattanLength(), 4);  // what is under the pointer stays there
    key(Qt::Key_R);
    for (const Plane plane : kPlanes)
        EXPECT_NEAR(scale(plane), before[static_cast<std::size_t>(plane)], 1e-6);
}

TEST(Slab, HasTheMaximumOrTheMeanOfItsSlices) {
    std::mt19937 random(3);
    std::uniform_int_distribution<int> level(-500, 500);
    Geometry geometry;
    geometry.dims = {6, 7, 8};
    geometry.spacing = {1, 1.5, 2};
    for (const Mat3d& direction :
         {Mat3d{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}, Mat3d{{{0, 0, -1}, {1, 0, 0}, {0, -1, 0}}}}) {
        geometry.direction = direction;
        Volume volume(geometry, SampleType::float32);
        for (std::int64_t i = 0; i < geometry.sample_count(); ++i)
            volume.samples<float>()[i] = i % 5 == 0 ? std::nanf("") : static_cast<float>(level(random));
        for (const Plane plane : kPlanes) {
            const viewer::SliceGeometry slice = slice_geometry(geometry, plane);
            const auto through = static_cast<std::size_t>(slice.through);
            const auto spacing = geometry.spacing[through];
            const std::int64_t last = geometry.dims[through] - 1;
            for (const std::int64_t middle : {std::int64_t{0}, last / 2, last}) {
                const auto slab = [&](Slab::Mode mode) {
                    return slab_samples(volume, slice, middle, {mode, 3 * spacing});
                };
                const std::vector<float> highest = slab(Slab::Mode::maximum), mean = slab(Slab::Mode::mean);
                std::vector<std::vector<float>> slices;
                for (std::int64_t t = std::max<std::int64_t>(middle - 1, 0); t <= std::min(middle + 1, last);
                     ++t)
                    slices.push_back(slice_samples(volume, slice, t));
                for (std::size_t i = 0; i < highest.size(); ++i) {
                    std::vector<float> finite;
                    for (const auto& samples : slices) {
                        if (std::isfinite(samples[i])) finite.push_back(samples[i]);
                    }
                    if (finite.empty()) {
                        EXPECT_TRUE(std::isnan(highest[i]) && std::isnan(mean[i]));
                        continue;
                    }
                    EXPECT_EQ(highest[i], *std::max_element(finite.begin(), finite.end()));
                    const double sum = std::accumulate(finite.begin(), finite.end(), 0.0);
                    EXPECT_FLOAT_EQ(mean[i], static_cast<float>(sum / static_cast<double>(finite.size())));
                }
            }
        }
    }
}

TEST_F(Views, SlicesShowASlab) {
    viewer::SliceView* axial = slice(Plane::axial);
    session().set_crosshair({24, 22, 6});
    const int id = session().parameters().current;
    const auto lines = axial->contour_of(id);
    const auto edge = [&] { return axial->widget_point({24, 9, 6}).toPoint(); };  // outside in this slice
    move(axial, edge());
    const QString single = axial->readout();
    views()->set_slab({Slab::Mode::maximum, 20});
    const QString highest = axial->readout();
    views()->set_slab({Slab::Mode::mean, 20});
    const QString mean = axial->readout();
    const auto value = [](const QString& text) { return text.section(' ', 0, 0).toDouble(); };
    EXPECT_GT(value(highest), value(mean));
    EXPECT_GT(value(mean), value(single));
    EXPECT_EQ(axial->contour_of(id), lines);  // of the slice in the middle
    views()->set_slab({});
    EXPECT_EQ(axial->readout(), single);
    // The menu shows the choice.
    auto* menu = window->findChild<QMenu*>("slab");
    ASSERT_TRUE(menu);
    EXPECT_TRUE(menu->actions().front()->isChecked());
    menu->actions().last()->trigger();
    EXPECT_TRUE(views()->slab() == (Slab{Slab::Mode::mean, 40}));
    EXPECT_FALSE(menu->actions().front()->isChecked());
    EXPECT_TRUE(menu->actions().last()->isChecked());
}

TEST_F(Views, ADoubleClickShowsAViewAlone) {
    const Vec3d crosshair = session().crosshair();
    for (const Plane plane : kPlanes) {
        double_click(slice(plane), QPoint(40, 40));
        EXPECT_EQ(visible_views(), std::vector<QWidget*>{slice(plane)});
        EXPECT_EQ(session().crosshair(), crosshair);  // the first click does not count
        double_click(slice(plane), QPoint(40, 40));
        EXPECT_EQ(visible_views().size(), 4u);
    }
    double_click(view(), view()->rect().center());
    EXPECT_EQ(visible_views(), std::vector<QWidget*>{view()});
    EXPECT_EQ(session().crosshair(), crosshair);
    EXPECT_GT(count(picture(), warm), 1000);
    double_click(view(), view()->rect().center());
    EXPECT_EQ(visible_views().size(), 4u);
    // Two clicks to measure are not a double click.
    key(Qt::Key_D);
    double_click(slice(Plane::axial), QPoint(60, 60));
    EXPECT_EQ(visible_views().size(), 4u);
}

TEST_F(Views, AHiddenViewIsUpToDateWhenItIsShownAgain) {
    key(Qt::Key_1);
    key(Qt::Key_X);
    const int ball = count(picture(), warm);
    views()->show_alone(slice(Plane::axial));
    session().set_isovalue(600);  // a smaller ball
    ASSERT_TRUE(wait([&] { return window->surfaces().settled(); }));
    views()->show_alone(nullptr);
    const int smaller = count(picture(), warm);
    EXPECT_LT(smaller, 0.4 * ball);
    EXPECT_GT(smaller, 0.05 * ball);
}

TEST_F(Views, FourViewsHaveTheSameSizeAndAreRemembered) {
    views()->set_layout_choice(Layout::square);
    QApplication::processEvents();
    EXPECT_NEAR(view()->width(), slice(Plane::axial)->width(), 2);
    EXPECT_NEAR(view()->height(), slice(Plane::axial)->height(), 2);
    EXPECT_LT(slice(Plane::coronal)->mapToGlobal({0, 0}).x(), slice(Plane::axial)->mapToGlobal({0, 0}).x());
    EXPECT_GT(count(picture(), warm), 1000);
    window->close();
    window = std::make_unique<viewer::MainWindow>();
    EXPECT_EQ(views()->layout_choice(), Layout::square);
    // A view that is alone leaves room for the others the next time.
    views()->set_layout_choice(Layout::column);
    views()->show_alone(slice(Plane::sagittal));
    window->close();
    window = std::make_unique<viewer::MainWindow>();
    window->show();
    ASSERT_TRUE(open(scan));
    EXPECT_EQ(visible_views().size(), 4u);
    for (QWidget* each : visible_views()) {
        EXPECT_GT(each->width(), 120) << each->objectName().toStdString();
        EXPECT_GT(each->height(), 100) << each->objectName().toStdString();
    }
}

TEST_F(Views, EndsOfMeasurementsAreDraggedOnASlice) {
    viewer::SliceView* coronal = slice(Plane::coronal);
    const auto at = [&](double x, double z) { return coronal->widget_point({x, 22, z}).toPoint(); };
    click_on_slice(Plane::axial, {24, 22, 12});
    key(Qt::Key_D);
    click_on_slice(Plane::coronal, {10, 22, 5});
    click_on_slice(Plane::coronal, {34, 22, 5});
    key(Qt::Key_N);
    const auto& measurement = [&]() -> const viewer::Measurement& {
        return session().parameters().measurements[0];
    };
    const Vec3d first = measurement().points[0];
    EXPECT_NEAR(measurement().value(), 24, 0.8);

    const Vec3d crosshair = session().crosshair();
    drag(coronal, at(34, 5), at(10, 15));
    EXPECT_EQ(session().crosshair(), crosshair);
    EXPECT_EQ(measurement().points[0], first);
    EXPECT_NEAR(measurement().value(), 20, 0.8);
    EXPECT_NEAR(measurement().points[1][1], first[1], 1e-9);  // still in the slice
    key(Qt::Key_Z, Qt::ControlModifier);                      // one step of undo
    EXPECT_NEAR(measurement().value(), 24, 0.8);

    // Not from a slice in which the end does not lie, nor out of the scan.
    session().set_crosshair({24, 30, 12});
    drag(coronal, at(34, 5), at(10, 15));
    EXPECT_NEAR(measurement().value(), 24, 0.8);
    session().set_crosshair({24, 22, 12});
    drag(coronal, at(34, 5), QPoint(2, 2));
    for (const Vec3d& point : measurement().points) {
        EXPECT_GE(point[0], position_of({-0.5, 0, 0})[0]);
        EXPECT_LE(point[2], position_of({0, 0, kSlices - 0.5})[2]);
    }
}

TEST_F(Views, AClickOnAnEndStillSetsTheCrosshairOrMeasures) {
    key(Qt::Key_D);
    click_on_slice(Plane::axial, {10, 20, 12});
    click_on_slice(Plane::axial, {34, 20, 12});
    click_on_slice(Plane::axial, {34, 20, 12});  // the next distance starts where this one ends
    click_on_slice(Plane::axial, {34, 40, 12});
    ASSERT_EQ(session().parameters().measurements.size(), 2u);
    EXPECT_NEAR(session().parameters().measurements[1].value(), 20, 0.8);
    key(Qt::Key_N);
    click_on_slice(Plane::axial, {10, 20, 12});
    EXPECT_NEAR(session().crosshair()[0], 10, 0.3);
    EXPECT_EQ(session().parameters().measurements.size(), 2u);
}

TEST_F(Views, EndsOfMeasurementsAreDraggedOnTheSurface) {
    key(Qt::Key_1);
    key(Qt::Key_D);
    ASSERT_TRUE(settle());
    const Vec3d centre = position_of(kMiddle);
    const auto on_front = [&](double x, double z) {  // of the ball
        return view()
            ->widget_point(
                {centre[0] + x, centre[1] - std::sqrt(kRadius * kRadius - x * x - z * z), centre[2] + z})
            ->toPoint();
    };
    for (const double x : {-9.0, 9.0})
        QTest::mouseClick(view(), Qt::LeftButton, Qt::NoModifier, on_front(x, 0));
    key(Qt::Key_N);
    ASSERT_TRUE(settle());
    const Vec3d direction = view()->view_direction();
    drag(view(), on_front(9, 0), on_front(0, 9));
    ASSERT_EQ(session().parameters().measurements.size(), 1u);
    EXPECT_NEAR(session().parameters().measurements[0].value(), 9 * std::sqrt(2), 0.5);
    EXPECT_EQ(view()->view_direction(), direction);  // the drag does not turn the view
    // Dragged beside the ball, it stays on its surface.
    drag(view(), on_front(0, 9), QPoint(5, 5));
    for (const Vec3d& point : session().parameters().measurements[0].points)
        EXPECT_NEAR(distance(point, centre), kRadius, 0.3);
}

// A projection mirrors what is behind the camera to the other side of the view.
TEST_F(Views, NothingBehindTheCameraIsDragged) {
    const Vec3d eye{34, 30, 54}, end{36, 42, 54};
    session().change("measure", {}, [&](viewer::Parameters& p) { p.measurements = {{{end, {34, 45, 54}}}}; });
    const auto drag_from_mirrored = [&](const Vec3d& position) {
        view()->set_camera({eye, {34, 0, 54}, {0, 0, 1}});
        ASSERT_TRUE(settle());
        EXPECT_FALSE(view()->widget_point(position));
        const auto mirrored = view()->widget_point(2 * eye - position);
        ASSERT_TRUE(mirrored);
        const QPoint from = mirrored->toPoint();
        ASSERT_TRUE(view()->rect().contains(from));
        drag(view(), from, from + QPoint(30, 20));
        EXPECT_GT(distance(view()->camera().position, eye), 0.1) << "the drag did not turn the view";
    };
    drag_from_mirrored(end);
    EXPECT_EQ(session().parameters().measurements[0].points[0], end);
    key(Qt::Key_K);
    const Vec3d handle = viewer::CropBox::handle(session().crop(), {1, true});  // the posterior side
    drag_from_mirrored(position_of(handle));
    EXPECT_FALSE(session().parameters().crop);
}

}  // namespace
}  // namespace marrow::test
