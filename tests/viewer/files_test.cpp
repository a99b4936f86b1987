// Tests opening scans and writing meshes and screenshots.
#include <numeric>
#include <set>

#include <nlohmann/json.hpp>

#include <QClipboard>
#include <QDialog>
#include <QMessageBox>
#include <QMimeData>
#include <QSignalSpy>
#include <QSpinBox>
#include <QTableWidget>
#include <QTextDocument>

#include "support/dicom_series.h"
#include "support/viewer_ball.h"
#include "window/measure_viewer.h"
#include "window/series_dialog.h"

namespace marrow::test {
namespace {

using viewer::Parameters;

TEST_F(BallViewer, ExportsTheSameFilesAsTheShownCommandLine) {
    const auto compare = [&](const char* extension, const char* what) {
        ASSERT_TRUE(settle());
        key(Qt::Key_S, Qt::ControlModifier);
        auto* dialog = window->findChild<viewer::ExportDialog*>("export_dialog");
        ASSERT_TRUE(dialog);
        const std::filesystem::path file = folder / (std::string("it's ours") + extension);
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
        std::filesystem::remove(file);
        QTest::qWait(1);  // deletes the dialog
    };
    for (const viewer::ExportFormat& format : viewer::kExportFormats) compare(format.extension, "unchanged");
    compare(".ply", "RAS");
    session().set_isovalue(123.456);
    compare(".stl", "a value between samples");
    window->findChild<QCheckBox*>("largest")->click();
    window->findChild<QCheckBox*>("open")->click();
    EXPECT_TRUE(session().parameters().largest && session().parameters().open);
    compare(".stl", "largest, open");
    window->findChild<QCheckBox*>("largest")->click();
    for (const auto& [name, value] : {std::pair{"components", 2}, {"smooth", 12}, {"keep", 40}})
        window->findChild<QSpinBox*>(name)->setValue(value);
    EXPECT_TRUE(window->command().contains("--components 2 --smooth 12 --keep 0.4"));
    compare(".stl", "two components, smoothed, reduced");
    for (const auto& [name, value] : {std::pair{"components", 0}, {"smooth", 0}, {"keep", 100}})
        window->findChild<QSpinBox*>(name)->setValue(value);
    window->findChild<QCheckBox*>("largest")->click();
    session().set_isovalue(*session().scan()->otsu);
    EXPECT_NE(window->command().indexOf("--isovalue otsu"), -1);
    compare(".vtp", "Otsu");
    QTest::mouseClick(window->findChildren<QPushButton*>("chip").front(), Qt::LeftButton);
    EXPECT_EQ(session().current()->isovalue, 225.5);
    EXPECT_NE(window->command().indexOf("--type bone"), -1);
    compare(".stl", "bone");
    // With a crop box, otsu would mean the isovalue of the cropped samples, so the command line has the
    // number.
    session().move_crop_side({0, true}, 30);
    session().move_crop_side({2, false}, 6);
    session().set_isovalue(*session().scan()->otsu);
    EXPECT_TRUE(window->command().contains("--crop vox:0,30,0,47,6,24"));
    EXPECT_FALSE(window->command().contains("--isovalue otsu"));
    compare(".stl", "cropped, Otsu");
    compare(".3mf", "cropped, Otsu, with its name");
    QTest::mouseClick(window->findChildren<QPushButton*>("chip").front(), Qt::LeftButton);
    window->findChild<QCheckBox*>("open")->click();
    compare(".ply", "cropped, bone, closed");
    window->findChild<QCheckBox*>("topology")->click();
    EXPECT_TRUE(window->command().contains("--topology"));
    compare(".ply", "cropped, bone, closed, exact topology");
    session().change("colour by shift", {}, [](Parameters& p) { p.colouring = viewer::Colouring::shift; });
    EXPECT_TRUE(window->command().contains("--trust"));
    for (const char* extension : {".ply", ".vtp", ".glb", ".stl"}) compare(extension, "with trust");
    window->findChild<QSpinBox*>("smooth")->setValue(5);
    compare(".ply", "smoothed, with trust");
}

TEST_F(BallViewer, ExportsAllVisibleSurfaces) {
    const int first = session().parameters().current;
    session().change("name", {}, [&](Parameters& p) { p.find(first)->name = "ball"; });
    session().add_surface("ball", 300, {}, 1);  // the same name, but another file name
    session().add_surface("hidden", 600, {}, 1);
    session().change("visibility", {}, [](Parameters& p) { p.surfaces[2].visible = false; });
    ASSERT_TRUE(settle());
    key(Qt::Key_S, Qt::ControlModifier);
    auto* dialog = window->findChild<viewer::ExportDialog*>("export_dialog");
    ASSERT_TRUE(dialog);
    auto* what = dialog->findChild<QComboBox*>("what");
    ASSERT_EQ(what->count(), 3);  // the two visible surfaces, and both
    for (int i = 0; i < what->count(); ++i) EXPECT_FALSE(what->itemText(i).contains("hidden"));
    what->setCurrentIndex(2);
    const TemporaryFolder out;
    dialog->set_file(out.path().c_str());
    const QStringList lines = dialog->commands().split('\n');
    ASSERT_EQ(lines.size(), 2);
    bool written = false;
    QObject::connect(window.get(), &viewer::MainWindow::written, [&] { written = true; });
    QTest::keyClick(dialog, Qt::Key_Return);
    ASSERT_TRUE(wait([&] { return written; }));
    const auto names = [&] {
        std::set<std::string> found;
        for (const auto& entry : std::filesystem::directory_iterator(out.path()))
            found.insert(entry.path().filename().string());
        return found;
    };
    const std::set<std::string> expected{"ball.stl", "ball-2.stl"};
    ASSERT_EQ(names(), expected) << window->banner().toStdString();
    const std::string ours[]{read_file(out / "ball.stl"), read_file(out / "ball-2.stl")};
    EXPECT_NE(ours[0], ours[1]);
    for (const std::string& name : expected) std::filesystem::remove(out / name);
    const std::string programs = std::filesystem::path(MARROW_PROGRAM).parent_path();
    for (const QString& line : lines)
        ASSERT_EQ(std::system(("PATH='" + programs + "':$PATH; " + line.toStdString() + " -q").c_str()), 0);
    ASSERT_EQ(names(), expected);
    EXPECT_TRUE(read_file(out / "ball.stl") == ours[0]);
    EXPECT_TRUE(read_file(out / "ball-2.stl") == ours[1]);
}

TEST_F(BallViewer, NamesWrittenFilesWithTheirPercentSigns) {
    const int first = session().parameters().current;
    session().add_surface({}, 300, {}, 1);
    ASSERT_TRUE(settle());
    window->write({{first, folder / "50%2.stl"}, {session().parameters().current, folder / "b.stl"}},
                  Space::LPS);
    ASSERT_TRUE(wait([&] { return !window->busy(); }));
    EXPECT_TRUE(window->banner().contains("50%2.stl and 1 more")) << window->banner().toStdString();
}

// The dialog knows only surfaces of the scan before.
TEST_F(BallViewer, TheExportDialogClosesWhenAnotherScanOpens) {
    write_nrrd(folder / "other.nrrd", 20, 20, 20, ball(10, 10, 10, 5));
    window->open(folder / "other.nrrd");
    key(Qt::Key_S, Qt::ControlModifier);
    auto* dialog = window->findChild<viewer::ExportDialog*>("export_dialog");
    ASSERT_TRUE(dialog && dialog->isVisible());
    dialog->findChild<QPushButton*>("browse")->click();
    ASSERT_TRUE(wait([&] { return !window->busy(); }));
    ASSERT_EQ(session().scan()->volume.geometry().dims[0], 20);
    QTest::qWait(1);  // deletes the dialog
    EXPECT_FALSE(window->findChild<viewer::ExportDialog*>("export_dialog"));
}

// The shown command line would write other files.
TEST_F(BallViewer, ExportsNoFileWithAPlaceholderInItsName) {
    key(Qt::Key_S, Qt::ControlModifier);
    auto* dialog = window->findChild<viewer::ExportDialog*>("export_dialog");
    ASSERT_TRUE(dialog);
    for (const auto& [name, possible] :
         {std::pair{"a{name}.stl", false}, {"a{b}.stl", false}, {"a{b.stl", true}}) {
        dialog->set_file((folder / name).c_str());
        EXPECT_EQ(dialog->findChild<QPushButton*>("accept")->isEnabled(), possible) << name;
    }
}

TEST_F(BallViewer, AsksBeforeItReplacesAFile) {
    const std::filesystem::path file = folder / "old.stl";
    write_file(file, "old");
    key(Qt::Key_S, Qt::ControlModifier);
    auto* dialog = window->findChild<viewer::ExportDialog*>("export_dialog");
    ASSERT_TRUE(dialog);
    dialog->set_file(QString::fromStdString(file.string()));
    QTest::keyClick(dialog, Qt::Key_Return);
    auto* box = dialog->findChild<QDialog*>("replace_box");
    ASSERT_TRUE(box);
    QTest::keyClick(box, Qt::Key_Escape);
    EXPECT_TRUE(dialog->isVisible());
    EXPECT_FALSE(window->busy());
    EXPECT_EQ(read_file(file), "old");
    QTest::qWait(1);  // deletes the question

    QTest::keyClick(dialog, Qt::Key_Return);
    box = dialog->findChild<QDialog*>("replace_box");
    ASSERT_TRUE(box);
    QTest::mouseClick(box->findChild<QPushButton*>("replace"), Qt::LeftButton);
    EXPECT_FALSE(dialog->isVisible());
    ASSERT_TRUE(wait([&] { return !window->busy(); }));
    EXPECT_NE(read_file(file), "old");
}

TEST_F(BallViewer, SaysThatSamplesLookLikeLabels) {
    write_nrrd(folder / "labels.nrrd", 30, 30, 30, [](int x, int y, int) { return 1 + (x > 15) + (y > 10); });
    ASSERT_TRUE(open(folder / "labels.nrrd"));
    EXPECT_TRUE(window->banner().contains("--labels")) << window->banner().toStdString();
}

// The same warning as that of the command line.
TEST_F(BallViewer, WarnsAtExport) {
    session().set_isovalue(session().scan()->histogram.lower);  // all samples are inside
    ASSERT_TRUE(settle());
    window->write({{session().parameters().current, folder / "box.stl"}}, Space::LPS);
    ASSERT_TRUE(wait([&] { return !window->busy(); }));
    EXPECT_TRUE(window->banner().contains("border of the scan")) << window->banner().toStdString();
    auto* remarks = window->findChild<QToolButton*>("remarks");
    EXPECT_TRUE(remarks->isVisible());
    key(Qt::Key_Escape);
    EXPECT_TRUE(window->banner().isEmpty());
    QTest::mouseClick(remarks, Qt::LeftButton);
    EXPECT_TRUE(window->banner().contains("border of the scan"));
}

// Specks can be neither smoothed nor reduced far. Colours by how far surfaces move assume Hounsfield units.
TEST_F(BallViewer, WarnsOfStepsAndAssumptionsAtExport) {
    write_nrrd(folder / "specks.nrrd", 24, 24, 24,
               [](int x, int y, int z) { return x % 6 == 2 && y % 6 == 2 && z % 6 == 2 ? 500 : -1000; });
    ASSERT_TRUE(open(folder / "specks.nrrd"));
    session().set_isovalue(0);
    window->findChild<QSpinBox*>("smooth")->setValue(20);
    window->findChild<QSpinBox*>("keep")->setValue(1);
    session().change("colours", {}, [](Parameters& p) { p.colouring = viewer::Colouring::shift; });
    ASSERT_TRUE(settle());
    window->write({{session().parameters().current, folder / "specks.ply"}}, Space::LPS);
    ASSERT_TRUE(wait([&] { return !window->busy(); }));
    const Outcome outcome = marrow_with({folder / "specks.nrrd", "--isovalue", "0", "--smooth", "20",
                                         "--keep", "0.01", "--trust", "-o", folder / "command.ply"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    for (const char* text : {"smooth: 64 components are too small", "reduce: 5 triangles were requested",
                             "assumed to be Hounsfield units"}) {
        EXPECT_NE(outcome.err.find(text), std::string::npos) << text << "\n" << outcome.err;
        EXPECT_TRUE(window->banner().contains(text)) << text << "\n" << window->banner().toStdString();
    }
}

// A wall of bone that is too thin for the scan, in a box that is open on two sides. The command line looks
// for it beside the surface as it was extracted, before the other component is removed.
TEST_F(BallViewer, WarnsOfThinWallsAtExport) {
    write_nrrd(folder / "thin.nrrd", 40, 40, 24, [](int x, int y, int z) {
        const bool within = x > 6 && x < 33 && y > 6 && y < 33 && z > 6 && z < 17;
        const bool frame = within && !(x > 11 && x < 28 && y > 11 && y < 28);
        const bool speck = x == 3 && y == 3 && z == 20;
        const int noise = (x * 7 + y * 13 + z * 5) % 11 - 5;
        return (frame || speck ? 1200 : within && z == 12 ? -100 : -1000) + noise;
    });
    ASSERT_TRUE(open(folder / "thin.nrrd"));
    window->findChild<QCheckBox*>("largest")->click();
    session().apply_preset("bone");
    ASSERT_TRUE(settle());
    const std::filesystem::path file = folder / "thin.stl";
    window->write({{session().parameters().current, file}}, Space::LPS);
    ASSERT_TRUE(wait([&] { return !window->busy(); }));
    const Outcome outcome =
        marrow_with({folder / "thin.nrrd", "--type", "bone", "--largest", "-o", folder / "command.stl"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const std::string mark = "warning: ", text = "too thin for the scan";
    const std::size_t at = outcome.err.rfind(mark, outcome.err.find(text));
    ASSERT_NE(at, std::string::npos) << outcome.err;
    const std::string warning =
        outcome.err.substr(at + mark.size(), outcome.err.find('\n', at) - at - mark.size());
    EXPECT_TRUE(window->banner().contains(warning.c_str())) << window->banner().toStdString();
    EXPECT_TRUE(read_file(file) == read_file(folder / "command.stl"));
    // With colours, the numbers of points say which are beside these walls.
    session().change("colours", {}, [](Parameters& p) { p.colouring = viewer::Colouring::shift; });
    ASSERT_TRUE(settle());
    window->write({{session().parameters().current, folder / "thin.ply"}}, Space::LPS);
    ASSERT_TRUE(wait([&] { return !window->busy(); }));
    const Outcome trusted = marrow_with(
        {folder / "thin.nrrd", "--type", "bone", "--largest", "--trust", "-o", folder / "command.ply"});
    ASSERT_EQ(trusted.code, 0) << trusted.err;
    EXPECT_TRUE(read_file(folder / "thin.ply") == read_file(folder / "command.ply"));
    // It is about bone, and not about any isovalue.
    session().apply_preset("skin");
    ASSERT_TRUE(settle());
    window->write({{session().parameters().current, file}}, Space::LPS);
    ASSERT_TRUE(wait([&] { return !window->busy(); }));
    EXPECT_FALSE(window->banner().contains(text.c_str())) << window->banner().toStdString();
}

// Smoothing and reduction change the surface, and the light says whether it is still valid.
TEST_F(BallViewer, RefinesAndChecksSurfaces) {
    const int id = session().parameters().current;
    const std::size_t triangles = window->surfaces().exact(id)->mesh->triangles.size();
    const auto lines = [&] { return window->slice_view(viewer::Plane::axial)->contour_of(id).size(); };
    const int lines_before = lines();
    auto* light = window->findChild<QLabel*>("closedness");
    window->findChild<QSpinBox*>("smooth")->setValue(20);
    window->findChild<QSpinBox*>("keep")->setValue(25);
    ASSERT_TRUE(settle());
    const auto shape = window->surfaces().exact(id);
    EXPECT_NEAR(shape->mesh->triangles.size(), 0.25 * triangles, 2);
    EXPECT_NEAR(shape->measures->volume, 4.0 / 3 * M_PI * std::pow(kRadius, 3), 500);
    ASSERT_TRUE(wait([&] { return shape->self_intersections.has_value(); }));
    EXPECT_EQ(*shape->self_intersections, 0);
    EXPECT_TRUE(light->text().endsWith("closed")) << light->text().toStdString();
    // Slices show the refined surface.
    EXPECT_LT(lines(), lines_before);
    key(Qt::Key_Z, Qt::ControlModifier);
    EXPECT_EQ(session().parameters().keep, 100);
    EXPECT_EQ(window->findChild<QSpinBox*>("keep")->value(), 100);
}

class Turntables : public BallViewer {
  protected:
    /// Begins to save images of 200 x 150 pixels.
    viewer::Pictures* save(const TemporaryFolder& out, int frames) {
        window->findChild<QAction*>("frames")->trigger();
        auto* dialog = window->findChild<viewer::ScreenshotDialog*>("screenshot_dialog");
        for (const auto& [name, value] : {std::pair{"width", 200}, {"height", 150}, {"frames", frames}})
            dialog->findChild<QSpinBox*>(name)->setValue(value);
        dialog->findChild<QLineEdit*>("file")->setText(out.path().c_str());
        QTest::keyClick(dialog, Qt::Key_Return);
        return view()->findChild<viewer::Pictures*>();
    }
};

// During one turn, the small ball moves around the large one. Afterwards, the view is as before.
TEST_F(Turntables, ShowOneFullTurn) {
    const auto large = ball(24, 24, 12, 10), small = ball(40, 24, 12, 5);
    write_nrrd(folder / "two.nrrd", kSide, kSide, kSlices,
               [&](int x, int y, int z) { return std::max(large(x, y, z), small(x, y, z)); });
    ASSERT_TRUE(open(folder / "two.nrrd"));
    session().set_isovalue(0);
    key(Qt::Key_X);
    key(Qt::Key_1);
    ASSERT_TRUE(settle());
    const Vec3d direction = view()->view_direction();
    const TemporaryFolder out, disturbed;
    ASSERT_TRUE(save(out, 4));
    ASSERT_TRUE(wait([&] { return !window->busy(); }));
    EXPECT_TRUE(window->banner().contains("4 images")) << window->banner().toStdString();
    std::vector<double> centres;  // horizontal centres of the drawn pixels
    for (int frame = 0; frame < 4; ++frame) {
        const QImage image((out / ("frame-000" + std::to_string(frame) + ".png")).c_str());
        ASSERT_EQ(image.size(), QSize(200, 150));
        double sum = 0;
        int pixels = 0;
        for (int y = 0; y < 150; ++y) {
            for (int x = 0; x < 200; ++x) {
                const bool cube = x > 140 && y > 90;
                if (!cube && warm(image.pixel(x, y))) sum += x, ++pixels;
            }
        }
        ASSERT_GT(pixels, 500);
        centres.push_back(sum / pixels);
    }
    EXPECT_FALSE(std::filesystem::exists(out / "frame-0004.png"));
    EXPECT_GT(std::abs(centres[0] - centres[2]), 4);  // once on the left, once on the right
    EXPECT_LT((centres[1] - centres[0]) * (centres[1] - centres[2]),
              0);  // behind or in front of the large ball
    EXPECT_EQ(view()->view_direction(), direction);
    // The images are the same if the view turns meanwhile.
    viewer::Pictures* turntable = save(disturbed, 4);
    ASSERT_TRUE(turntable);
    QObject::connect(turntable, &viewer::Pictures::progressed, [&] { view()->turn(30); });
    ASSERT_TRUE(wait([&] { return !window->busy(); }));
    for (int frame = 0; frame < 4; ++frame) {
        const std::string name = "frame-000" + std::to_string(frame) + ".png";
        EXPECT_TRUE(QImage((out / name).c_str()) == QImage((disturbed / name).c_str())) << name;
    }
}

TEST_F(Turntables, WaitForFullResolution) {
    const TemporaryFolder early, late;
    session().change("work", {}, [](Parameters& p) {
        p.surfaces[0].isovalue = 600;
        p.smooth = 200;
    });
    ASSERT_TRUE(save(early, 2));
    ASSERT_TRUE(wait([&] { return !window->busy(); }));
    ASSERT_TRUE(settle());
    ASSERT_TRUE(save(late, 2));
    ASSERT_TRUE(wait([&] { return !window->busy(); }));
    for (const char* name : {"frame-0000.png", "frame-0001.png"})
        EXPECT_TRUE(QImage((early / name).c_str()) == QImage((late / name).c_str())) << name;
}

TEST_F(Turntables, CanBeCancelled) {
    const viewer::CameraState before = view()->camera();
    const auto stop_after_three = [&](const std::function<void()>& stop) {
        const TemporaryFolder out;
        viewer::Pictures* turntable = save(out, 40);
        ASSERT_TRUE(turntable);
        QObject::connect(turntable, &viewer::Pictures::progressed, [&](int frame) {
            if (frame == 3) stop();
        });
        ASSERT_TRUE(wait([&] { return !window->busy(); }));
        EXPECT_TRUE(window->banner().contains("3 of 40")) << window->banner().toStdString();
        EXPECT_EQ(std::distance(std::filesystem::directory_iterator(out.path()), {}), 3);
        EXPECT_EQ(view()->camera().position, before.position);
    };
    stop_after_three([&] { key(Qt::Key_Escape); });
    auto* cancel = window->findChild<QToolButton*>("cancel");
    stop_after_three([&] { QTest::mouseClick(cancel, Qt::LeftButton); });
    EXPECT_FALSE(cancel->isVisible());
    stop_after_three([&] { window->close(); });
    EXPECT_TRUE(window->isVisible()) << "to say how many images were written";
}

TEST_F(BallViewer, StopsAnExport) {
    const TemporaryFolder out;
    write_file(out / "ball.stl", "old");
    const auto write = [&] {
        window->write({{session().parameters().current, out / "ball.stl"}}, Space::LPS);
    };
    // At once, because a moment later the export may have ended.
    const auto connection =
        QObject::connect(window->findChild<viewer::MeshWriter*>(), &viewer::MeshWriter::started, [&] {
            EXPECT_TRUE(window->busy());
            key(Qt::Key_Escape);
        });
    write();
    ASSERT_TRUE(wait([&] { return !window->busy(); }));
    EXPECT_NE(window->banner().indexOf("cancelled"), -1) << window->banner().toStdString();
    EXPECT_EQ(read_file(out / "ball.stl"), "old");
    QObject::disconnect(connection);
    write();  // a second request works
    ASSERT_TRUE(wait([&] { return !window->busy(); }));
    EXPECT_NE(read_file(out / "ball.stl"), "old");
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(out.path()), {}), 1);
}

TEST_F(BallViewer, ShowsWhyAFileCannotBeWritten) {
    window->write({{session().parameters().current, folder / "nowhere" / "ball.stl"}}, Space::LPS);
    ASSERT_TRUE(wait([&] { return !window->busy(); }));
    EXPECT_NE(window->banner().indexOf("nowhere"), -1) << window->banner().toStdString();
}

TEST_F(BallViewer, RemembersTheFolderOfARelativeName) {
    const QString before = QDir::currentPath();
    ASSERT_TRUE(QDir::setCurrent(folder.path().c_str()));
    window->write({{session().parameters().current, "ball.stl"}}, Space::LPS);
    ASSERT_TRUE(wait([&] { return !window->busy(); }));
    QDir::setCurrent(before);
    window->findChild<QAction*>("frames")->trigger();
    auto* dialog = window->findChild<viewer::ScreenshotDialog*>("screenshot_dialog");
    EXPECT_EQ(dialog->findChild<QLineEdit*>("file")->text().toStdString(), folder.path());
}

TEST_F(BallViewer, ClosesAfterAnExportThatNeedsNoWords) {
    const auto write = [&](const std::filesystem::path& file, bool close) {
        window->write({{session().parameters().current, file}}, Space::LPS);
        if (close) window->close();
        EXPECT_TRUE(window->isVisible());
        EXPECT_TRUE(wait([&] { return !window->busy(); }));
    };
    write(folder / "nowhere" / "ball.stl", true);
    EXPECT_TRUE(window->isVisible());
    EXPECT_TRUE(window->banner().contains("nowhere")) << window->banner().toStdString();
    write(folder / "ball.stl", false);
    EXPECT_TRUE(window->isVisible());

    session().set_isovalue(session().scan()->histogram.lower);  // all samples are inside
    ASSERT_TRUE(settle());
    write(folder / "box.stl", true);
    EXPECT_TRUE(window->isVisible());
    EXPECT_TRUE(window->banner().contains("border of the scan")) << window->banner().toStdString();

    session().set_isovalue(0);
    session().add_surface({}, 600, {}, 1);
    ASSERT_TRUE(settle());
    write(folder / "ball.stl", true);
    auto* question = window->findChild<QMessageBox*>("discard_box");
    ASSERT_TRUE(question);
    QTest::mouseClick(question->button(QMessageBox::Cancel), Qt::LeftButton);
    QTest::qWait(20);  // deletes the question
    write(folder / "ball.stl", false);
    EXPECT_TRUE(window->isVisible());
    EXPECT_FALSE(window->findChild<QMessageBox*>("discard_box"));

    session().set_saved();
    write(folder / "ball.stl", true);
    EXPECT_FALSE(window->isVisible());
}

TEST_F(BallViewer, ABadFileKeepsThePreviousScan) {
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
    // A picture that need not wait leaves the progress alone.
    key(Qt::Key_C, Qt::ControlModifier);
    const QString progress = window->findChild<QLabel*>("facts")->text();
    EXPECT_TRUE(progress.startsWith("Opening")) << progress.toStdString();
    key(Qt::Key_Escape);
    EXPECT_FALSE(window->busy());
    QTest::qWait(300);
    EXPECT_EQ(session().scan(), before);
    ASSERT_TRUE(open(folder / "large.nrrd"));  // a second request works
    EXPECT_EQ(session().scan()->volume.geometry().dims[0], 200);
}

void drop(QWidget& window, const QList<QUrl>& files) {
    QMimeData data;
    data.setUrls(files);
    QDragEnterEvent enter(QPoint(100, 100), Qt::CopyAction, &data, Qt::LeftButton, Qt::NoModifier);
    QApplication::sendEvent(&window, &enter);
    EXPECT_TRUE(enter.isAccepted());
    QDropEvent drop(QPointF(100, 100), Qt::CopyAction, &data, Qt::LeftButton, Qt::NoModifier);
    QApplication::sendEvent(&window, &drop);
}

TEST_F(BallViewer, OpensADroppedFile) {
    write_nrrd(folder / "dropped.nrrd", 20, 20, 20, ball(10, 10, 10, 5));
    const viewer::Scan* before = session().scan();
    drop(*window, {QUrl::fromLocalFile((folder / "dropped.nrrd").c_str())});
    ASSERT_TRUE(wait([&] { return session().scan() != before; }));
    EXPECT_EQ(session().scan()->volume.geometry().dims[0], 20);
}

TEST_F(BallViewer, SaysWhichOfSeveralDroppedFilesIsOpen) {
    write_nrrd(folder / "dropped.nrrd", 20, 20, 20, ball(10, 10, 10, 5));
    const viewer::Scan* before = session().scan();
    drop(*window,
         {QUrl::fromLocalFile((folder / "dropped.nrrd").c_str()), QUrl::fromLocalFile(scan.c_str())});
    ASSERT_TRUE(wait([&] { return session().scan() != before; }));
    EXPECT_EQ(session().scan()->volume.geometry().dims[0], 20);
    for (const char* part : {"2 items", "dropped.nrrd", "folder"})
        EXPECT_TRUE(window->banner().contains(part)) << window->banner().toStdString();
    ASSERT_TRUE(open(scan));
    EXPECT_FALSE(window->banner().contains("2 items")) << window->banner().toStdString();
}

// Names may look like HTML.
TEST_F(BallViewer, ShowsNamesAsTheyAre) {
    const auto expect_plain = [](const QWidget& shown, int least) {
        int labels = 0;
        for (const QLabel* label : shown.findChildren<QLabel*>()) {
            if (!label->text().contains("<b>")) continue;
            EXPECT_EQ(label->textFormat(), Qt::PlainText) << label->text().toStdString();
            ++labels;
        }
        EXPECT_GE(labels, least);
    };
    const std::filesystem::path odd = folder / "<b>bold.nrrd";
    std::filesystem::copy(scan, odd);
    ASSERT_TRUE(open(odd));
    ASSERT_TRUE(window->save_session(folder / "<b>bold.marrow"));
    expect_plain(*window, 2);  // the banner and the facts

    session().change("name", {}, [](Parameters& p) { p.surfaces[0].name = "<b>none"; });
    session().set_isovalue(5000);
    ASSERT_TRUE(settle());
    write_file(folder / "<b>old.stl", "old");
    key(Qt::Key_S, Qt::ControlModifier);
    auto* dialog = window->findChild<viewer::ExportDialog*>("export_dialog");
    ASSERT_TRUE(dialog);
    expect_plain(*dialog, 1);  // that there is no surface
    session().set_isovalue(0);
    ASSERT_TRUE(settle());
    dialog->set_file((folder / "<b>old.stl").c_str());
    QTest::keyClick(dialog, Qt::Key_Return);
    auto* box = dialog->findChild<QMessageBox*>("replace_box");
    ASSERT_TRUE(box);
    expect_plain(*box, 1);
    dialog->reject();

    viewer::OpenQuestion question{viewer::OpenQuestion::About::series, odd, {}, {}, {false}};
    question.report.series.resize(1);
    question.report.series[0].series.id = "<b>1 & 2";
    question.report.series[0].refusal = "it is <b>damaged</b>";
    const viewer::SeriesDialog series(question, window.get());
    auto* table = series.findChild<QTableWidget*>("series");
    QTextDocument tip;
    tip.setHtml(table->item(0, 1)->toolTip());
    EXPECT_EQ(tip.toPlainText(), "<b>1 & 2");
    tip.setHtml(table->item(0, table->columnCount() - 1)->toolTip());
    EXPECT_EQ(tip.toPlainText(), "it is <b>damaged</b>");
}

// The padding, which is between air and tissue here, is no peak of the histogram.
TEST_F(BallViewer, LeavesOutThePaddingOfAScan) {
    const TemporaryFolder series;
    constexpr int kValues[]{-1000, -990, -500, -500, -500, -500, 40, 60};
    std::vector<std::int16_t> samples;
    for (int i = 0; i < 64; ++i) samples.push_back(static_cast<std::int16_t>(kValues[i % 8]));
    for (int k = 0; k < 3; ++k) {
        DicomWriter slice;
        slice.pixels(8, 8, samples);
        slice.position("0\\0\\" + std::to_string(k));
        slice.number(0x00280120, 65536 - 500);
        slice.write(series / ("slice" + std::to_string(k)));
    }
    ASSERT_TRUE(open(series.path()));
    const viewer::Scan& scan = *session().scan();
    EXPECT_EQ(scan.info.padding, -500);
    EXPECT_EQ(std::accumulate(scan.histogram.counts.begin(), scan.histogram.counts.end(), 0), 3 * 32);
    ASSERT_TRUE(scan.otsu);
    const Outcome outcome =
        marrow_with({series.path(), "-o", folder / "otsu.stl", "--isovalue", "otsu", "--json", "--quiet"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(nlohmann::json::parse(outcome.out)["isovalue"], *scan.otsu);
    EXPECT_NEAR(*scan.otsu, -470, 20) << "the middle between air and tissue, without padding";
}

// A series of `slices` slices whose left half is bright.
void write_half_bright(const std::filesystem::path& folder, const std::string& uid, int slices,
                       const std::function<void(DicomWriter&, int)>& change = {}) {
    constexpr int kSize = 16;
    std::vector<std::int16_t> samples;
    for (int i = 0; i < kSize * kSize; ++i) samples.push_back(i % kSize < kSize / 2 ? 1000 : 0);
    for (int k = 0; k < slices; ++k) {
        DicomWriter slice;
        slice.pixels(kSize, kSize, samples);
        slice.position("0\\0\\" + std::to_string(k));
        slice.text(0x0020000e, "UI", uid);
        if (change) change(slice, k);
        slice.write(folder / (uid + "-" + std::to_string(k)));
    }
}

// The surface lies in the frame of reference of the scan.
TEST_F(BallViewer, ExportsDicomAsTheCommandLineDoes) {
    const TemporaryFolder series;
    write_half_bright(series.path(), "1.2.3", 5,
                      [](DicomWriter& slice, int) { slice.text(0x00200052, "UI", "1.2.3.4"); });
    ASSERT_TRUE(open(series.path()));
    key(Qt::Key_S, Qt::ControlModifier);
    auto* dialog = window->findChild<viewer::ExportDialog*>("export_dialog");
    ASSERT_TRUE(dialog);
    const std::filesystem::path file = folder / "half.dcm";
    dialog->set_file(file.c_str());
    auto* space = dialog->findChild<QComboBox*>("space");
    auto* accept = dialog->findChild<QPushButton*>("accept");
    EXPECT_TRUE(accept->isEnabled());
    space->setCurrentIndex(1);
    EXPECT_FALSE(accept->isEnabled()) << "RAS";
    space->setCurrentIndex(0);
    const std::string line = dialog->commands().toStdString();
    QTest::keyClick(dialog, Qt::Key_Return);
    ASSERT_TRUE(wait([&] { return !window->busy(); }));
    const std::string ours = read_file(file);
    EXPECT_NE(ours.find("1.2.3.4"), ours.npos) << window->banner().toStdString();
    std::filesystem::remove(file);
    const std::string programs = std::filesystem::path(MARROW_PROGRAM).parent_path();
    ASSERT_EQ(std::system(("PATH='" + programs + "':$PATH; " + line + " -q").c_str()), 0) << line;
    EXPECT_TRUE(read_file(file) == ours);
}

TEST_F(BallViewer, DoesNotExportOverTheScan) {
    const TemporaryFolder series;
    write_half_bright(series.path(), "1.2.3", 5);
    std::filesystem::rename(series / "1.2.3-2", series / "slice.dcm");
    const std::string before = read_file(series / "slice.dcm");
    const auto write = [&](const std::filesystem::path& input) {
        ASSERT_TRUE(open(input));
        window->write({{session().parameters().current, series / "slice.dcm"}}, Space::LPS);
        ASSERT_TRUE(wait([&] { return !window->busy(); }));
        EXPECT_TRUE(window->banner().contains("overwrite the input")) << window->banner().toStdString();
        EXPECT_TRUE(read_file(series / "slice.dcm") == before);
    };
    write(series.path());
    write(series / "1.2.3-0");
}

// Slices may be images, too.
TEST_F(BallViewer, ScreenshotsDoNotReplaceASlice) {
    const TemporaryFolder slices;
    for (const char* name : {"1.png", "2.png", "3.png"}) {
        QImage slice(8, 6, QImage::Format_Grayscale8);
        slice.fill(name[0] == '2' ? 200 : 0);
        ASSERT_TRUE(slice.save(QString::fromStdString(slices / name)));
    }
    const std::string before = read_file(slices / "2.png");
    window->open(slices.path(), {.spacing = Vec3d{1, 1, 1}});
    ASSERT_TRUE(wait([&] { return !window->busy(); }) && settle());
    window->findChild<QAction*>("screenshot")->trigger();
    auto* dialog = window->findChild<viewer::ScreenshotDialog*>("screenshot_dialog");
    ASSERT_TRUE(dialog);
    dialog->findChild<QLineEdit*>("file")->setText(QString::fromStdString(slices / "2.png"));
    QTest::keyClick(dialog, Qt::Key_Return);
    QTest::mouseClick(dialog->findChild<QPushButton*>("replace"), Qt::LeftButton);
    EXPECT_TRUE(window->banner().contains("overwrite the input")) << window->banner().toStdString();
    EXPECT_TRUE(read_file(slices / "2.png") == before);
}

// The samples stay as stored where their values have a fraction; all that is shown are values.
TEST_F(BallViewer, ShowsTheValuesOfAScanThatKeepsItsSamples) {
    const TemporaryFolder series;
    write_half_bright(series.path(), "1.2.3", 5,
                      [](DicomWriter& slice, int) { slice.rescale("1", "-1000.4"); });
    ASSERT_TRUE(open(series.path()));
    const viewer::Scan& scan = *session().scan();
    EXPECT_EQ(scan.volume.type(), SampleType::int16);
    EXPECT_EQ(scan.volume.rescale(), (Rescale{1, -1000.4}));
    EXPECT_TRUE(scan.hounsfield);
    EXPECT_NEAR(scan.histogram.lower, -1000.4, 1e-9);
    EXPECT_NEAR(scan.histogram.upper, -0.4, 1e-9);
    ASSERT_TRUE(scan.otsu);
    EXPECT_NEAR(*scan.otsu, -500.4, 20);
    viewer::SliceView* axial = window->slice_view(viewer::Plane::axial);
    session().set_crosshair({3, 8, 2});
    EXPECT_EQ(axial->readout(), "-0.4 HU");
    session().set_crosshair({12, 8, 2});
    EXPECT_EQ(axial->readout(), "-1000.4 HU");
    EXPECT_NEAR(viewer::sample_at(scan.volume, 3, 8, 2), -0.4, 1e-9);
    EXPECT_LT(window->histogram_bar()->x_of(-900), window->histogram_bar()->x_of(-100));
    // The surface lies where the values pass the isovalue.
    session().set_isovalue(-100.4);
    ASSERT_TRUE(settle());
    const QVector<QLineF> lines = axial->contour_of(session().parameters().current);
    ASSERT_FALSE(lines.empty());
    double furthest = 0;
    for (const QLineF& line : lines) furthest = std::max({furthest, line.x1(), line.x2()});
    EXPECT_NEAR(furthest, 7.1, 1e-3);
}

// The samples of slices are rounded to floats, and may then be below the isovalue.
TEST_F(BallViewer, OutlinesSamplesAtTheIsovalue) {
    const TemporaryFolder series;
    write_half_bright(series.path(), "1.2.3", 5,
                      [](DicomWriter& slice, int) { slice.rescale("0.0007", "0"); });
    ASSERT_TRUE(open(series.path()));
    const double highest = session().scan()->histogram.upper;
    ASSERT_LT(static_cast<float>(highest), highest);
    session().set_isovalue(highest);
    ASSERT_TRUE(settle());
    const int id = session().parameters().current;
    ASSERT_FALSE(window->surfaces().exact(id)->mesh->triangles.empty());
    EXPECT_FALSE(window->slice_view(viewer::Plane::axial)->contour_of(id).empty());
}

class Questions : public BallViewer {
  protected:
    template <class Dialog>
    Dialog* question(const std::filesystem::path& input, const char* name, const ScanOptions& options = {}) {
        before = session().scan();
        window->open(input, options);
        return next_question<Dialog>(name);
    }
    template <class Dialog>
    Dialog* next_question(const char* name) {
        EXPECT_TRUE(wait([&] { return window->findChild<Dialog*>(name) != nullptr; }))
            << window->banner().toStdString();
        return window->findChild<Dialog*>(name);
    }
    /// Two series, of which the larger one, 1.2.3, has uneven slices.
    void write_even_and_uneven() {
        write_half_bright(input.path(), "1.2.3", 20, [](DicomWriter& slice, int k) {
            if (k == 19) slice.position("0\\0\\20.5");
        });
        write_half_bright(input.path(), "1.2.4", 3);
    }
    /// Presses Enter, and waits until the scan is open.
    bool accept(QDialog* dialog) {
        QTest::keyClick(dialog, Qt::Key_Return);
        return wait([&] { return session().scan() != before; });
    }

    const viewer::Scan* before = nullptr;
    TemporaryFolder input;
};

TEST_F(Questions, AskWhichSeries) {
    write_half_bright(input.path(), "1.2.3", 5, [](DicomWriter& slice, int) {
        slice.text(0x00200011, "IS", "7");
        slice.text(0x00080021, "DA", "20050726");
        slice.text(0x0008103e, "LO", "thin slices");
    });
    write_half_bright(input.path(), "1.2.4", 6);
    write_half_bright(input.path(), "1.2.5", 1, [](DicomWriter& image, int) {
        image.pixels(64, 64, std::vector<std::int16_t>(64 * 64));
    });
    auto* dialog = question<viewer::SeriesDialog>(input.path(), "series_dialog");
    ASSERT_TRUE(dialog);
    auto* table = dialog->findChild<QTableWidget*>("series");
    ASSERT_EQ(table->rowCount(), 3);
    int seven = 0;
    while (seven < 2 && table->item(seven, 1)->text() != "7") ++seven;
    const auto cell = [&](int column) { return table->item(seven, column)->text(); };
    EXPECT_EQ(cell(2), "thin slices");
    EXPECT_EQ(cell(3), "2005-07-26");
    EXPECT_EQ(cell(4), "CT");
    EXPECT_EQ(cell(5), "16 × 16 × 5\n1 × 1 × 1 mm");
    ASSERT_TRUE(wait([&] { return !table->item(seven, 0)->icon().isNull(); }));
    const QImage picture = table->item(seven, 0)->icon().pixmap(72, 72).toImage();
    EXPECT_GT(qGray(picture.pixel(18, 36)), 200);
    EXPECT_LT(qGray(picture.pixel(54, 36)), 50);
    ASSERT_TRUE(accept(dialog));  // the larger volume is preselected
    EXPECT_EQ(session().scan()->volume.geometry().dims[2], 6);
    EXPECT_TRUE(window->command().contains("--series 1.2.4")) << window->command().toStdString();
}

TEST_F(Questions, AskWhichVolume) {
    for (const char* echo : {"10", "20"}) {
        write_half_bright(input.path(), std::string("1.2.3"), 4, [&](DicomWriter& slice, int) {
            slice.text(0x00080060, "CS", "MR");
            slice.text(0x00180081, "DS", echo);
        });
        for (int k = 0; k < 4; ++k) {
            const std::string name = "1.2.3-" + std::to_string(k);
            std::filesystem::rename(input / name, input / (echo + name));
        }
    }
    auto* dialog = question<viewer::SeriesDialog>(input.path(), "series_dialog");
    ASSERT_TRUE(dialog);
    auto* volume = dialog->findChild<QComboBox*>("volume");
    ASSERT_EQ(volume->count(), 2);
    EXPECT_EQ(volume->itemText(1), "1:  echo time 20 ms");
    volume->setCurrentIndex(1);
    ASSERT_TRUE(accept(dialog));
    EXPECT_EQ(session().scan()->options.volume, 1);
    EXPECT_TRUE(window->command().contains("--volume 1")) << window->command().toStdString();
    EXPECT_FALSE(window->command().contains("--series"));
}

TEST_F(Questions, AskForTheSpacing) {
    for (int k = 0; k < 4; ++k) {
        QImage slice(8, 6, QImage::Format_Grayscale8);
        slice.fill(k == 1 ? 200 : 0);
        ASSERT_TRUE(slice.save(QString::fromStdString(input / ("slice" + std::to_string(k) + ".png"))));
    }
    auto* dialog = question<viewer::SpacingDialog>(input.path(), "spacing_dialog");
    ASSERT_TRUE(dialog);
    auto* open = dialog->findChild<QPushButton*>("accept");
    const auto type = [&](const char* name, const char* mm) {
        auto* field = dialog->findChild<QLineEdit*>(name);
        field->clear();
        QTest::keyClicks(field, mm);
    };
    EXPECT_FALSE(open->isEnabled()) << "there is no default";
    type("spacing_0", "0.00004");
    type("spacing_1", "0.00325");
    EXPECT_FALSE(open->isEnabled());
    for (const char* wrong : {"0", "-1", "1,25", "1.25 cm", "inf"}) {
        type("spacing_2", wrong);
        EXPECT_FALSE(open->isEnabled()) << wrong;
    }
    type("spacing_2", "1.25");
    ASSERT_TRUE(open->isEnabled());
    ASSERT_TRUE(accept(dialog));
    EXPECT_EQ(session().scan()->volume.geometry().spacing, (Vec3d{0.00004, 0.00325, 1.25}));
    EXPECT_TRUE(window->command().contains("--spacing 4e-05,0.00325,1.25"))
        << window->command().toStdString();
    const Vec3d known{0.48828125, 1e-7 / 3, 1234.5};
    EXPECT_EQ(viewer::SpacingDialog(known, window.get()).spacing(), known);
}

// --measure ends as the command line does, because nobody is there to answer.
TEST_F(Questions, AreErrorsWhileTheViewerIsMeasured) {
    QImage image(8, 6, QImage::Format_Grayscale8);
    image.fill(0);
    ASSERT_TRUE(image.save(QString::fromStdString(input / "slice.png")));
    const auto measured = [&](const std::filesystem::path& measured_input) {
        testing::internal::CaptureStderr();
        const int code = viewer::measure_viewer(*window, measured_input, {});
        return std::pair{code, testing::internal::GetCapturedStderr()};
    };
    window = std::make_unique<viewer::MainWindow>();  // without a scan
    const auto [code, line] = measured(input.path());
    EXPECT_EQ(code, 4);
    EXPECT_NE(line.find("--spacing"), std::string::npos) << line;
    EXPECT_FALSE(window->findChild<QDialog*>());
    write_file(folder / "bad.marrow", "{}");
    const auto [bad_code, bad_line] = measured(folder / "bad.marrow");
    EXPECT_EQ(bad_code, 3);
    EXPECT_NE(bad_line.find("marrow_session is missing"), std::string::npos) << bad_line;
}

TEST_F(Questions, AskWhetherToInterpolateUnevenSlices) {
    write_half_bright(input.path(), "1.2.3", 5, [](DicomWriter& slice, int k) {
        if (k == 4) slice.position("0\\0\\5.5");
    });
    auto* box = question<QDialog>(input.path(), "uneven_box");
    ASSERT_TRUE(box);
    QTest::keyClick(box, Qt::Key_Escape);
    EXPECT_EQ(session().scan(), before);
    QTest::qWait(1);  // deletes the question
    box = question<QDialog>(input.path(), "uneven_box");
    ASSERT_TRUE(box);
    ASSERT_TRUE(accept(box));
    EXPECT_TRUE(session().scan()->options.resample);
    EXPECT_TRUE(window->command().contains("--resample")) << window->command().toStdString();
}

TEST_F(Questions, AreAskedOneAfterTheOther) {
    write_even_and_uneven();
    auto* dialog = question<viewer::SeriesDialog>(input.path(), "series_dialog");
    ASSERT_TRUE(dialog);
    auto* table = dialog->findChild<QTableWidget*>("series");
    QStringList remarks;
    for (int row = 0; row < 2; ++row) remarks << table->item(row, table->columnCount() - 1)->text();
    EXPECT_TRUE(remarks.join(' ').contains("--resample")) << remarks.join(' ').toStdString();
    QTest::keyClick(dialog, Qt::Key_Return);
    auto* box = next_question<QDialog>("uneven_box");
    ASSERT_TRUE(box);
    ASSERT_TRUE(accept(box));
    EXPECT_TRUE(session().scan()->options.resample);
    EXPECT_EQ(session().scan()->options.series, "1.2.3");
}

// They agree with what the headers state, here the distances between columns and rows.
TEST_F(Questions, AskForTheSpacingThatASeriesLacks) {
    const auto spaced = [](DicomWriter& slice, int) { slice.spacing("0.5\\0.25"); };
    write_half_bright(input.path(), "1.2.3", 7, [&](DicomWriter& slice, int k) {
        spaced(slice, k);
        slice.elements.erase(0x00200032);  // the position
    });
    write_half_bright(input.path(), "1.2.4", 3);
    const auto open_with_2_mm_between_slices = [&] {
        auto* dialog = next_question<viewer::SpacingDialog>("spacing_dialog");
        ASSERT_TRUE(dialog);
        dialog->findChild<QLineEdit*>("spacing_2")->setText("2");
        ASSERT_TRUE(accept(dialog));
        EXPECT_EQ(session().scan()->volume.geometry().spacing, (Vec3d{0.25, 0.5, 2}));
    };
    auto* dialog = question<viewer::SeriesDialog>(input.path(), "series_dialog");
    ASSERT_TRUE(dialog);
    QTest::keyClick(dialog, Qt::Key_Return);
    open_with_2_mm_between_slices();
    const TemporaryFolder single;
    write_half_bright(single.path(), "1.2.5", 1, spaced);
    before = session().scan();
    window->open(single.path());
    open_with_2_mm_between_slices();
    // Only some of many spacings are tried at once.
    for (int i = 1; i < 9; ++i)
        write_half_bright(single.path(), "1.2." + std::to_string(i), 1, [&](DicomWriter& slice, int) {
            slice.spacing(i == 8 ? "0.5\\0.25" : std::to_string(i) + "\\1");
        });
    dialog = question<viewer::SeriesDialog>(single.path(), "series_dialog");
    ASSERT_TRUE(dialog);
    auto* table = dialog->findChild<QTableWidget*>("series");
    ASSERT_EQ(table->rowCount(), 8);
    for (int row = 0; row < 8; ++row) EXPECT_TRUE(table->item(row, 1)->flags() & Qt::ItemIsSelectable) << row;
    QTest::keyClick(dialog, Qt::Key_Escape);
    window->open(single / "1.2.8-0");
    open_with_2_mm_between_slices();
}

// An option or a file may say which series is meant, and then no other one is offered.
TEST_F(Questions, AreOnlyAboutTheSeriesThatIsMeant) {
    write_even_and_uneven();
    write_half_bright(input.path(), "1.2.5", 4,
                      [](DicomWriter& slice, int) { slice.orientation("1\\0\\0\\1\\1\\0"); });
    for (const std::string echo : {"10", "20"}) {
        const TemporaryFolder one;
        write_half_bright(one.path(), "1.2.6", 4, [&](DicomWriter& slice, int) {
            slice.text(0x00080060, "CS", "MR");
            slice.text(0x00180081, "DS", echo);
        });
        for (const auto& file : std::filesystem::directory_iterator(one.path()))
            std::filesystem::copy(file, input / (echo + file.path().filename().string()));
    }
    for (const auto& [named, series] :
         {std::pair{input.path(), std::optional<std::string>("1.2.3")}, {input / "1.2.3-0", std::nullopt}}) {
        auto* box = question<QDialog>(named, "uneven_box", {.series = series});
        ASSERT_TRUE(box);
        EXPECT_FALSE(window->findChild<viewer::SeriesDialog*>());
        ASSERT_TRUE(accept(box));
        EXPECT_GT(session().scan()->volume.geometry().dims[2], 20);
        ASSERT_TRUE(open(scan));
    }
    auto* volumes = question<viewer::SeriesDialog>(input.path(), "series_dialog", {.series = "1.2.6"});
    ASSERT_TRUE(volumes);
    EXPECT_EQ(volumes->findChild<QTableWidget*>("series")->rowCount(), 1);
    EXPECT_EQ(volumes->findChild<QComboBox*>("volume")->count(), 2);
    ASSERT_TRUE(accept(volumes));
    EXPECT_EQ(session().scan()->info.series.id, "1.2.6");
    // No decision helps, so the reason is shown instead of a question.
    window->open(input.path(), {.series = "1.2.5"});
    ASSERT_TRUE(wait([&] { return !window->busy(); }));
    EXPECT_TRUE(window->banner().contains("1.2.5")) << window->banner().toStdString();
    EXPECT_FALSE(window->findChild<viewer::SeriesDialog*>());
}

TEST_F(Questions, HideAnEarlierError) {
    window->open(folder / "missing.nii");
    ASSERT_TRUE(wait([&] { return !window->busy(); }));
    ASSERT_FALSE(window->banner().isEmpty());
    write_even_and_uneven();
    ASSERT_TRUE(question<viewer::SeriesDialog>(input.path(), "series_dialog"));
    EXPECT_TRUE(window->banner().isEmpty()) << window->banner().toStdString();
}

TEST_F(Questions, DoNotMakeTheWindowForgetWorkDuringLoading) {
    write_half_bright(input.path(), "1.2.3", 5);
    write_half_bright(input.path(), "1.2.4", 6);
    before = session().scan();
    window->open(input.path());
    session().add_surface({}, 100, {}, 1);
    ASSERT_TRUE(wait([&] { return window->findChild<viewer::SeriesDialog*>() != nullptr; }));
    QTest::keyClick(window->findChild<viewer::SeriesDialog*>(), Qt::Key_Return);
    ASSERT_TRUE(wait([&] { return window->findChild<QMessageBox*>("discard_box") != nullptr; }));
    EXPECT_EQ(session().scan(), before);
}

// The dialog may close at any time while pictures are made.
TEST_F(Questions, CanBeLeftWhilePicturesAreMade) {
    for (int i = 0; i < 20; ++i) write_half_bright(input.path(), "1.2." + std::to_string(i), 2);
    for (const int ms : {0, 1, 5, 20}) {
        auto* dialog = question<viewer::SeriesDialog>(input.path(), "series_dialog");
        ASSERT_TRUE(dialog);
        QTest::qWait(ms);
        QTest::keyClick(dialog, Qt::Key_Escape);
        ASSERT_TRUE(wait([&] { return !window->findChild<viewer::SeriesDialog*>(); }));
    }
    EXPECT_EQ(session().scan(), before);
}

// Lines, dots and texts of a picture have the size that they have in the view, whatever the picture's size.
TEST_F(BallViewer, ScreenshotsLookLikeTheView) {
    session().change("measure", {}, [](viewer::Parameters& p) {
        p.measurements = {{{position_of({4, 2, 12}), position_of({44, 2, 12})}}};  // in front of the ball
    });
    key(Qt::Key_1);
    ASSERT_TRUE(settle());
    const auto marked = [](QRgb c) { return qBlue(c) > 150 && qGreen(c) > 120 && qRed(c) < 130; };
    const auto written = [](QRgb c) { return qBlue(c) > 200 && qGreen(c) > 200 && qRed(c) > 200; };
    const auto counted = [&](const QImage& image) {
        const QImage rgb = image.convertToFormat(QImage::Format_RGB32);
        const double all = image.width() * image.height();
        return std::pair{count(rgb, marked) / all, count(rgb, written) / all};
    };
    const auto [line, text] = counted(picture());
    ASSERT_GT(line, 0);
    ASSERT_GT(text, 0);
    for (const int scale : {1, 2}) {
        const auto [other_line, other_text] = counted(view()->screenshot(scale * view()->size()));
        EXPECT_NEAR(other_line / line, 1, 0.3) << scale;
        EXPECT_NEAR(other_text / text, 1, 0.3) << scale;
    }
}

TEST_F(BallViewer, ScreenshotsHaveTheRequestedSize) {
    const QImage image = view()->screenshot({640, 360});
    EXPECT_EQ(image.size(), QSize(640, 360));
    const QImage rgb = image.convertToFormat(QImage::Format_RGB32);
    EXPECT_GT(count(rgb, warm), 640 * 360 / 20);
    // The image in the window is unchanged.
    EXPECT_GT(count(picture(), warm), 1000);
    view()->set_light_background(true);
    EXPECT_GT(qGray(picture().pixel(3, 3)), 200);
}

// Where full frames are slow, as without a graphics card, a moving view shows the preview.
TEST_F(BallViewer, ScreenshotsOfAMovingViewHaveTheFullShape) {
    const auto large = ball(64, 64, 50, 50);
    write_nrrd(folder / "rough.nrrd", 128, 128, 100, [&](int x, int y, int z) {
        return large(x, y, z) + 500 * std::sin(x * 1.3) * std::sin(y * 1.3) * std::sin(z * 1.7);
    });
    ASSERT_TRUE(open(folder / "rough.nrrd"));
    ASSERT_GT(window->surfaces().preview_level(), 0);
    session().change("glass", {}, [](Parameters& p) { p.surfaces[0].opacity = 0.5; });  // slower
    ASSERT_TRUE(settle());
    const QSize size(400, 300);
    const QImage still = view()->screenshot(size);
    ASSERT_TRUE(view()->screenshot(size) == still);
    view()->set_moving(true);
    EXPECT_TRUE(view()->screenshot(size) == still);
}

// The preview of this surface is neither smooth nor as fine.
TEST_F(BallViewer, PicturesWaitForFullResolution) {
    const auto large = ball(64, 64, 50, 50);
    write_nrrd(folder / "rough.nrrd", 128, 128, 100, [&](int x, int y, int z) {
        return large(x, y, z) + 500 * std::sin(x * 1.3) * std::sin(y * 1.3) * std::sin(z * 1.7);
    });
    ASSERT_TRUE(open(folder / "rough.nrrd"));
    ASSERT_GT(window->surfaces().preview_level(), 0);
    session().change("smooth", {}, [](Parameters& p) { p.smooth = 20; });
    key(Qt::Key_C, Qt::ControlModifier);
    EXPECT_TRUE(window->busy());
    EXPECT_TRUE(window->findChild<QToolButton*>("cancel")->isVisible());
    // At once, because another program may write to the clipboard.
    QImage copied;
    QObject::connect(view()->findChild<viewer::Pictures*>(), &viewer::Pictures::finished, [&] {
        copied = QApplication::clipboard()->image().convertToFormat(QImage::Format_RGB32);
    });
    ASSERT_TRUE(wait([&] { return !window->busy(); }));
    EXPECT_EQ(window->banner(), "Copied the 3D view.");
    ASSERT_FALSE(copied.isNull());
    ASSERT_TRUE(settle());
    const QImage late = view()->screenshot(copied.size()).convertToFormat(QImage::Format_RGB32);
    int different = 0;
    for (int y = 0; y < late.height(); ++y) {
        for (int x = 0; x < late.width(); ++x)
            different += std::abs(qRed(copied.pixel(x, y)) - qRed(late.pixel(x, y))) > 6;
    }
    EXPECT_LT(different, 20);
}

TEST_F(BallViewer, APictureThatWaitsCanBeCancelled) {
    session().set_isovalue(600);
    key(Qt::Key_C, Qt::ControlModifier);
    EXPECT_TRUE(window->busy());
    QSignalSpy finished(view()->findChild<viewer::Pictures*>(), &viewer::Pictures::finished);
    key(Qt::Key_Escape);
    EXPECT_FALSE(window->busy());
    EXPECT_TRUE(window->banner().startsWith("Cancelled")) << window->banner().toStdString();
    ASSERT_TRUE(settle());
    ASSERT_EQ(finished.count(), 1);
    EXPECT_EQ(finished[0], (QVariantList{0, QString()}));
    // The window does not wait for one, either.
    session().set_isovalue(500);
    key(Qt::Key_C, Qt::ControlModifier);
    EXPECT_TRUE(window->busy());
    window->close();
    EXPECT_FALSE(window->isVisible());
}

TEST_F(BallViewer, TheViewFitsTheFirstSurfaceAfterAPictureOfNone) {
    const auto empty =
        QObject::connect(&session(), &viewer::Session::scan_changed, [&] { session().set_isovalue(1e6); });
    ASSERT_TRUE(open(scan));
    QObject::disconnect(empty);
    const viewer::CameraState before = view()->camera();
    key(Qt::Key_C, Qt::ControlModifier);
    ASSERT_TRUE(settle());
    session().set_isovalue(0);
    ASSERT_TRUE(settle());
    const viewer::CameraState fitted = view()->camera();
    EXPECT_NE(fitted.position, before.position);
    view()->reset_view();
    EXPECT_LT(distance(view()->camera().position, fitted.position), 1e-6);
}

TEST_F(BallViewer, TheLightThemeIsForTheWholeWindow) {
    const auto brightness = [&](const char* name) {
        const QImage image = window->findChild<QWidget*>(name)->grab().toImage();
        return qGray(image.pixel(2, 2));
    };
    for (const char* name : {"panel", "bottom", "tools"}) EXPECT_LT(brightness(name), 60) << name;
    key(Qt::Key_B);
    for (const char* name : {"panel", "bottom", "tools"}) EXPECT_GT(brightness(name), 190) << name;
    EXPECT_TRUE(view()->light_background());
    key(Qt::Key_B);
    for (const char* name : {"panel", "bottom", "tools"}) EXPECT_LT(brightness(name), 60) << name;
}

}  // namespace
}  // namespace marrow::test
