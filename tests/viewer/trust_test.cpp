// Tests surfaces of exact topology, and colours that show how far surfaces can be trusted.
#include <QCheckBox>
#include <QComboBox>

#include <marrow/isosurface.h>
#include <marrow/trust.h>

#include "support/viewer_ball.h"
#include "views/slice_geometry.h"
#include "views/trust_legend.h"

namespace marrow::test {
namespace {

using viewer::Colouring;

class Trust : public BallViewer {
  protected:
    // With the keyboard, from the top of the list.
    void colour_by(Colouring colouring) {
        auto* box = window->findChild<QComboBox*>("colouring");
        QTest::keyClick(box, Qt::Key_Home);
        for (int i = 0; i < static_cast<int>(colouring); ++i) QTest::keyClick(box, Qt::Key_Down);
        EXPECT_EQ(session().parameters().colouring, colouring);
    }
    std::shared_ptr<const viewer::Shape> shape() {
        EXPECT_TRUE(settle());
        return window->surfaces().exact(session().parameters().current);
    }
    // Of a point of the ball.
    static int hue_of(Colouring colouring, const TrustReport& report) {
        const double distance =
            colouring == Colouring::shift ? report.shifts.median : report.noise_shifts.median;
        const auto [red, green, blue] = trust_colour(distance / viewer::largest_shown(colouring, report));
        return QColor(red, green, blue).hue();
    }
    // The colour near the middle of the ball.
    QColor middle() {
        const QImage image = picture();
        return image.pixelColor(image.rect().center() + QPoint(12, 12));
    }
    // Whether the lower left corner has the dark end of the scale.
    bool has_legend() {
        const QImage image = picture();
        const QRect corner(0, image.height() - 60, 250, 60);
        return count(image.copy(corner), [](QRgb c) { return qRed(c) > 100 && qGreen(c) < 40; }) > 50;
    }
};

TEST_F(Trust, TheColourIsThatOfTheDistance) {
    key(Qt::Key_X);
    key(Qt::Key_1);
    const QColor own = middle();
    EXPECT_FALSE(shape()->trust);
    EXPECT_FALSE(has_legend());

    colour_by(Colouring::shift);
    ASSERT_TRUE(shape()->trust);
    // The samples of the ball change by 1000 HU over its radius.
    EXPECT_NEAR(shape()->trust->shifts.median, 100 * kRadius / 1000, 0.05);
    const TrustReport expected = report_trust(session().scan()->volume, shape()->mesh->points, {.step = 100});
    EXPECT_EQ(shape()->trust->shift, expected.shift);
    EXPECT_EQ(shape()->trust->noise_shift, expected.noise_shift);
    EXPECT_NEAR(middle().hue(), hue_of(Colouring::shift, *shape()->trust), 8);
    EXPECT_TRUE(has_legend());

    colour_by(Colouring::noise);
    EXPECT_NEAR(middle().hue(), hue_of(Colouring::noise, *shape()->trust), 8);
    EXPECT_GT(std::abs(hue_of(Colouring::noise, expected) - hue_of(Colouring::shift, expected)), 16);
    EXPECT_TRUE(has_legend());

    for (int i = 0; i < 2; ++i) key(Qt::Key_Z, Qt::ControlModifier);
    EXPECT_EQ(session().parameters().colouring, Colouring::own);
    EXPECT_EQ(middle(), own);
    EXPECT_FALSE(has_legend());
}

TEST_F(Trust, ColoursFollowTheSurface) {
    colour_by(Colouring::shift);
    session().set_isovalue(300);
    EXPECT_EQ(shape()->trust->shift.size(), shape()->mesh->points.size());
    window->findChild<QCheckBox*>("open")->click();
    session().move_crop_side({0, true}, 20);
    session().change("steps", {}, [](viewer::Parameters& p) { p.keep = 30; });
    EXPECT_EQ(shape()->trust->shift.size(), shape()->mesh->points.size());
    EXPECT_TRUE(has_legend());
    session().change("visibility", {}, [](viewer::Parameters& p) { p.surfaces[0].visible = false; });
    EXPECT_FALSE(has_legend());
}

TEST(TrustLegend, SaysWhatItsNumbersAre) {
    TrustReport report;
    report.step = 100;
    report.cap = 1.5;
    report.noise.sigma = 9.21;
    report.noise.windows = 12;
    EXPECT_EQ(viewer::legend_title(Colouring::shift, report, true), "mm per 100 HU of isovalue");
    EXPECT_EQ(viewer::legend_title(Colouring::shift, report, false), "mm per 100 of isovalue");
    EXPECT_EQ(viewer::legend_title(Colouring::noise, report, true), "mm by noise of 9.21 HU");
    report.noise.windows = 0;
    EXPECT_EQ(viewer::legend_title(Colouring::noise, report, true), "mm by noise, which is unknown");
    EXPECT_EQ(viewer::largest_shown(Colouring::shift, report), 1.5);
    EXPECT_LT(viewer::largest_shown(Colouring::noise, report), 1.5);
}

// A wall askew, which falls apart if inside corners are always separated.
TEST_F(ViewerTest, ExactTopologyKeepsAWallWhole) {
    write_nrrd(folder / "wall.nrrd", 14, 14, 8, [](int x, int y, int) { return x - y == 3 ? 100 : -50; });
    ASSERT_TRUE(open(folder / "wall.nrrd"));
    session().set_isovalue(0);
    ASSERT_TRUE(settle());
    const int id = session().parameters().current;
    const auto components = [&] { return window->surfaces().exact(id)->measures->components; };
    EXPECT_GT(components(), 5);
    viewer::SliceView* slice = window->slice_view(viewer::Plane::axial);
    const QVector<QLineF> separated = slice->contour_of(id);
    EXPECT_FALSE(window->command().contains("--topology"));

    window->findChild<QCheckBox*>("topology")->click();
    ASSERT_TRUE(settle());
    EXPECT_EQ(components(), 1);
    EXPECT_TRUE(window->command().contains("--topology"));
    const Volume& volume = session().scan()->volume;
    const auto shape = window->surfaces().exact(id);
    const Mesh expected = extract_isosurface(volume, 0, {.closed = true, .topology = true});
    EXPECT_EQ(shape->mesh->points, expected.points);
    EXPECT_EQ(shape->mesh->triangles, expected.triangles);
    // The outline joins the same corners, and no line is the same.
    const QVector<QLineF> joined = slice->contour_of(id);
    EXPECT_EQ(joined.size(), separated.size());
    EXPECT_NE(joined, separated);
    EXPECT_EQ(joined.size(), slice_mesh(*shape->mesh, volume.geometry(), session().whole_scan(),
                                        slice_geometry(volume.geometry(), viewer::Plane::axial),
                                        std::llround(session().crosshair()[2]))
                                 .size());

    key(Qt::Key_Z, Qt::ControlModifier);
    ASSERT_TRUE(settle());
    EXPECT_GT(components(), 5);
    EXPECT_EQ(slice->contour_of(id), separated);
    EXPECT_FALSE(window->findChild<QCheckBox*>("topology")->isChecked());
}

}  // namespace
}  // namespace marrow::test
