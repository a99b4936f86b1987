// Tests session files, the question before work is lost, and the table of measurements.
#include <QClipboard>
#include <QDoubleSpinBox>
#include <QDropEvent>
#include <QFileDialog>
#include <QMessageBox>
#include <QMimeData>
#include <QTimer>

#include <marrow/error.h>

#include "model/measurement_table.h"
#include "model/session_file.h"
#include "support/dicom_series.h"
#include "support/viewer_ball.h"
#include "window/dialogs.h"

namespace marrow::test {
namespace {

using viewer::Parameters;
using viewer::SavedSession;

class Sessions : public BallViewer {
  protected:
    void work() {
        session().change("work", {}, [](Parameters& p) {
            p.surfaces[0].name = "ball";
            p.surfaces[0].opacity = 0.5;
            p.crop = viewer::SampleBox{{1, 2, 3}, {40, 41, 20}};
            p.measurements = {{{{1.25, 2, 3}, {4, 6, 3}}}, {{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}}}};
            p.cut = {viewer::Plane::coronal, true};
            p.mode = viewer::DrawMode::wireframe;
            p.window = {12, 345};
            p.largest = true;
            p.topology = true;
            p.colouring = viewer::Colouring::noise;
        });
        session().add_surface({}, 600.5, QColor(20, 40, 60), 0.25);
        session().set_crosshair({5, 6, 7});
    }
    /// Saves the session by its action; `meanwhile` is called while the name is asked for.
    void save_as(const std::filesystem::path& file, const std::function<void()>& meanwhile = {}) {
        QTimer user;
        QObject::connect(&user, &QTimer::timeout, [&] {
            auto* files = qobject_cast<QFileDialog*>(QApplication::activeModalWidget());
            if (!files) return;
            QApplication::setActiveWindow(files);
            if (meanwhile) meanwhile();
            files->findChild<QLineEdit*>("fileNameEdit")->setText(file.c_str());
            QMetaObject::invokeMethod(files, "accept");
        });
        user.start(50);
        window->findChild<QAction*>("save_session")->trigger();
    }
    /// Types a name for the selected surface, without Enter.
    void type_name(const char* text) {
        key(Qt::Key_F2);
        auto* name = qobject_cast<QLineEdit*>(QApplication::focusWidget());
        ASSERT_TRUE(name);
        QTest::keyClicks(name, text);
    }
    QMessageBox* question() { return window->findChild<QMessageBox*>("discard_box"); }
    /// The name that "Save session" proposes.
    std::string proposed() {
        QString name;
        QTimer user;  // answers the dialog, which waits for it
        QObject::connect(&user, &QTimer::timeout, [&] {
            auto* files = qobject_cast<QFileDialog*>(QApplication::activeModalWidget());
            if (!files) return;
            name = files->findChild<QLineEdit*>("fileNameEdit")->text();
            files->reject();
        });
        user.start(50);
        window->findChild<QAction*>("save_session")->trigger();
        return name.toStdString();
    }
};

TEST_F(Sessions, OpenAsTheyWereSaved) {
    work();
    key(Qt::Key_3);
    ASSERT_TRUE(settle());
    const Parameters before = session().parameters();
    const viewer::CameraState camera = view()->camera();
    const std::filesystem::path file = folder / "mine.marrow";
    ASSERT_TRUE(window->save_session(file)) << window->banner().toStdString();
    EXPECT_FALSE(session().has_unsaved_work());
    // The folder can be moved, because the path of the scan is relative.
    const TemporaryFolder other;
    std::filesystem::copy(scan, other / scan.filename());
    std::filesystem::copy(file, other / "mine.marrow");
    std::filesystem::remove(scan);
    ASSERT_TRUE(open(other / "mine.marrow")) << window->banner().toStdString();

    Parameters after = session().parameters();
    ASSERT_EQ(after.surfaces.size(), 2u);
    EXPECT_EQ(after.current, after.surfaces[1].id);
    for (std::size_t i = 0; i < 2; ++i) {
        after.surfaces[i].id = before.surfaces[i].id;
        EXPECT_EQ(after.surfaces[i].colour.name(), before.surfaces[i].colour.name());
        after.surfaces[i].colour = before.surfaces[i].colour;  // QColor may hold more than 8 bits
    }
    after.current = before.current;
    EXPECT_TRUE(after == before);
    EXPECT_EQ(session().crosshair(), (Vec3d{5, 6, 7}));
    EXPECT_NEAR(distance(view()->camera().position, camera.position), 0, 1e-9);
    EXPECT_NEAR(distance(view()->camera().up, camera.up), 0, 1e-9);
    EXPECT_FALSE(session().has_unsaved_work());
    EXPECT_FALSE(session().undo_stack().canUndo());
}

// "link/.." is the folder above that which the link leads to, and not the folder that holds the link.
TEST_F(Sessions, KnowTheScanThatWasOpenedThroughALink) {
    std::filesystem::create_directories(folder / "elsewhere" / "deep");
    const std::filesystem::path other = folder / "elsewhere" / "ball.nrrd";
    write_nrrd(other, 20, 21, 22, ball(10, 10, 11, 5));
    std::filesystem::create_directory_symlink(folder / "elsewhere" / "deep", folder / "link");
    ASSERT_TRUE(open(folder / "link" / ".." / "ball.nrrd"));
    EXPECT_TRUE(window->command().contains(other.c_str())) << window->command().toStdString();
    EXPECT_EQ(QSettings().value("recent").toStringList().front(), other.c_str());
    ASSERT_TRUE(window->save_session(folder / "link" / ".." / "ball.marrow"));
    ASSERT_TRUE(open(scan));
    ASSERT_TRUE(open(folder / "elsewhere" / "ball.marrow")) << window->banner().toStdString();
    EXPECT_EQ(session().scan()->volume.geometry().dims[0], 20);
}

// Those that were saved before these settings existed.
TEST_F(Sessions, OlderOnesHaveTheirOwnColoursAndNoTopology) {
    work();
    ASSERT_TRUE(settle());
    const std::filesystem::path file = folder / "mine.marrow";
    ASSERT_TRUE(window->save_session(file));
    std::string content = read_file(file);
    for (const std::string line : {"  \"topology\": true,\n", "  \"colour_by\": \"noise\",\n"}) {
        ASSERT_NE(content.find(line), std::string::npos) << content;
        content.erase(content.find(line), line.size());
    }
    write_file(file, content);
    ASSERT_TRUE(open(file)) << window->banner().toStdString();
    EXPECT_FALSE(session().parameters().topology);
    EXPECT_EQ(session().parameters().colouring, viewer::Colouring::own);
    EXPECT_TRUE(session().parameters().largest);
}

TEST_F(Sessions, DamagedOnesSayWhyInOneLine) {
    work();
    ASSERT_TRUE(settle());
    const std::filesystem::path file = folder / "mine.marrow";
    ASSERT_TRUE(window->save_session(file));
    const std::string good = read_file(file);
    const viewer::Scan* before = session().scan();
    const auto changed = [&](const std::string& from, const std::string& to) {
        const auto at = good.find(from);
        EXPECT_NE(at, std::string::npos) << from;
        return std::string(good).replace(at, from.size(), to);
    };
    const std::vector<std::pair<std::string, const char*>> damaged{
        {good.substr(0, good.size() / 2), "not JSON"},
        {std::string(5000, '['), "not JSON"},
        {"[]", "JSON object"},
        {"{}", "marrow_session is missing"},
        {std::string(2 << 20, ' '), "too large"},
        {changed("\"marrow_session\": 1", "\"marrow_session\": 9"), "version"},
        {changed("ball.nrrd", "gone.nrrd"), "gone.nrrd"},
        {changed("\"isovalue\": 0.0", "\"isovalue\": null"), "surfaces[0].isovalue"},
        {changed("\"isovalue\": 0.0", "\"isovalue\": 1e999"), ""},
        {changed("\"opacity\": 0.5", "\"opacity\": 7"), "opacity"},
        {changed("\"wireframe\"", "\"fog\""), "draw"},
        {changed("\"topology\": true", "\"topology\": 3"), "topology"},
        {changed("\"noise\"", "\"fog\""), "colour_by"},
        {changed("\"coronal\"", "3"), "cut.plane"},
        {changed("\"width\": 345", "\"width\": -1"), "window.width"},
        {changed("1.25", "\"x\""), "measurements"},
        // Stale: the scan or the box does not fit.
        {changed("      48,\n      48,\n      25", "      48,\n      48,\n      26"), "another scan"},
        {changed("      40,\n      41,\n      20", "      40,\n      41,\n      99"), "crop box"},
    };
    for (const auto& [content, reason] : damaged) {
        write_file(file, content);
        window->open(file);
        ASSERT_TRUE(wait([&] { return !window->busy(); }));
        const std::string message = window->banner().toStdString();
        EXPECT_NE(message.find(reason), std::string::npos) << reason << ": " << message;
        EXPECT_EQ(message.find('\n'), std::string::npos) << message;
        EXPECT_FALSE(message.empty()) << content.substr(0, 100);
        EXPECT_EQ(session().scan(), before);
        EXPECT_EQ(session().parameters().surfaces.size(), 2u);
        key(Qt::Key_Escape);
    }
}

TEST_F(Sessions, WorkIsNotLostWithoutAQuestion) {
    write_nrrd(folder / "other.nrrd", 20, 20, 20, ball(10, 10, 10, 5));
    const viewer::Scan* before = session().scan();
    const auto drop = [&] {
        QMimeData data;
        data.setUrls({QUrl::fromLocalFile((folder / "other.nrrd").c_str())});
        QDragEnterEvent enter(QPoint(100, 100), Qt::CopyAction, &data, Qt::LeftButton, Qt::NoModifier);
        QApplication::sendEvent(window.get(), &enter);
        QDropEvent event(QPointF(100, 100), Qt::CopyAction, &data, Qt::LeftButton, Qt::NoModifier);
        QApplication::sendEvent(window.get(), &event);
    };
    work();
    drop();
    ASSERT_TRUE(question());
    QTest::keyClick(question(), Qt::Key_Escape);
    QTest::qWait(20);
    EXPECT_FALSE(window->busy());
    EXPECT_EQ(session().scan(), before);
    window->close();  // asks too
    EXPECT_TRUE(window->isVisible());
    ASSERT_TRUE(question());
    QTest::mouseClick(question()->button(QMessageBox::Cancel), Qt::LeftButton);
    QTest::qWait(20);

    drop();
    ASSERT_TRUE(question());
    QTest::mouseClick(question()->button(QMessageBox::Discard), Qt::LeftButton);
    ASSERT_TRUE(wait([&] { return session().scan() != before; }));
    // An isovalue is quick to find again.
    session().set_isovalue(1);
    EXPECT_FALSE(session().has_unsaved_work());
}

TEST_F(Sessions, WorkDuringLoadingIsNotLostWithoutAQuestion) {
    write_nrrd(folder / "other.nrrd", 20, 20, 20, ball(10, 10, 10, 5));
    const viewer::Scan* before = session().scan();
    work();
    const auto work_while_opening = [&](QMessageBox::StandardButton answer) {
        window->open(folder / "other.nrrd");
        session().add_surface({}, 100, {}, 1);
        EXPECT_TRUE(wait([&] { return !window->busy(); }));
        ASSERT_TRUE(question());
        QTest::mouseClick(question()->button(answer), Qt::LeftButton);
        QTest::qWait(20);  // deletes the question
    };
    work_while_opening(QMessageBox::Cancel);
    EXPECT_EQ(session().scan(), before);
    EXPECT_EQ(session().parameters().surfaces.size(), 3u);
    work_while_opening(QMessageBox::Discard);
    EXPECT_NE(session().scan(), before);
    EXPECT_EQ(session().parameters().surfaces.size(), 1u);
    // What was there before is asked about when the opening begins.
    work();
    before = session().scan();
    window->open(scan);
    ASSERT_TRUE(wait([&] { return session().scan() != before; }));
    EXPECT_FALSE(question());
}

TEST_F(Sessions, AreOfTheScanThatWasShownWhenTheyWereAskedFor) {
    work();
    write_nrrd(folder / "other.nrrd", 20, 20, 20, ball(10, 10, 10, 5));
    QTimer user;
    QObject::connect(&user, &QTimer::timeout, [&] {
        auto* files = qobject_cast<QFileDialog*>(QApplication::activeModalWidget());
        if (!files || session().scan()->volume.geometry().dims[0] != 20) return;
        files->findChild<QLineEdit*>("fileNameEdit")->setText((folder / "mine.marrow").c_str());
        QMetaObject::invokeMethod(files, "accept");
    });
    user.start(50);
    window->open(folder / "other.nrrd");
    const viewer::Scan* const before = session().scan();
    window->findChild<QAction*>("save_session")->trigger();
    ASSERT_NE(session().scan(), before);
    const SavedSession saved = viewer::read_session(folder / "mine.marrow");
    EXPECT_EQ(saved.scan, scan);
    EXPECT_EQ(saved.parameters.surfaces.size(), 2u);
}

TEST_F(Sessions, AreNotSavedIfTheyCouldNotBeOpened) {
    const std::filesystem::path file = folder / "mine.marrow";
    SavedSession large;
    large.scan = scan;
    large.parameters = session().parameters();
    large.parameters.measurements.assign(10001, {{{0, 0, 0}, {1, 0, 0}}});
    EXPECT_THROW(viewer::write_session(large, file), InputError);
    const std::filesystem::path latin = folder / "k\xf6ln.nrrd";
    std::filesystem::copy(scan, latin);
    ASSERT_TRUE(open(latin));
    EXPECT_FALSE(window->save_session(file));
    EXPECT_TRUE(window->banner().contains("not UTF-8")) << window->banner().toStdString();
    EXPECT_FALSE(std::filesystem::exists(file));
}

TEST_F(Sessions, AreSavedWhereTheShownOneCameFrom) {
    EXPECT_EQ(proposed(), "ball.marrow");
    ASSERT_TRUE(window->save_session(folder / "mine.marrow"));
    EXPECT_EQ(proposed(), "mine.marrow");
    write_file(folder / "bad.marrow", "{}");
    ASSERT_TRUE(window->save_session(folder / "mine.marrow"));
    window->open(folder / "bad.marrow");
    EXPECT_TRUE(window->banner().startsWith("Saved")) << "until something else is to say";
    ASSERT_TRUE(wait([&] { return !window->busy(); }));
    EXPECT_EQ(proposed(), "mine.marrow");
    ASSERT_TRUE(open(scan));
    EXPECT_EQ(proposed(), "ball.marrow");
    ASSERT_TRUE(open(folder / "mine.marrow"));
    EXPECT_EQ(proposed(), "mine.marrow");
}

TEST_F(Sessions, HaveNoMoreSurfacesThanTheirFilesHold) {
    for (int i = 0; i < 150; ++i) session().add_surface({}, i, {}, 1);
    EXPECT_EQ(session().parameters().surfaces.size(), Parameters::kMostSurfaces);
    ASSERT_TRUE(window->save_session(folder / "mine.marrow")) << window->banner().toStdString();
    EXPECT_EQ(viewer::read_session(folder / "mine.marrow").parameters.surfaces.size(),
              Parameters::kMostSurfaces);
    auto* add = window->findChild<QToolButton*>("add_surface");
    emit add->menu()->aboutToShow();
    ASSERT_EQ(add->menu()->actions().size(), 1);
    EXPECT_FALSE(add->menu()->actions().front()->isEnabled());
}

// The name of a folder may be a UID.
TEST_F(Sessions, AreNamedAfterTheWholeNameOfAFolder) {
    std::filesystem::create_directory(folder / "1.2.840.10");
    for (int k = 0; k < 5; ++k) slice(k, 2.0 * k).write(folder / "1.2.840.10" / std::to_string(k));
    for (const char* end : {"", "/", "/."}) {
        ASSERT_TRUE(open((folder / "1.2.840.10").string() + end));
        EXPECT_EQ(proposed(), "1.2.840.10.marrow") << end;
        EXPECT_EQ(window->windowTitle(), "1.2.840.10 – Marrow Viewer") << end;
        EXPECT_EQ(QSettings().value("recent").toStringList().front().toStdString(), folder / "1.2.840.10");
    }
}

TEST_F(Sessions, HoldWhatIsTypedIntoAField) {
    session().add_surface({}, 100, {}, 1);
    ASSERT_TRUE(settle());
    auto* isovalue = window->findChild<QDoubleSpinBox*>("isovalue");
    QApplication::setActiveWindow(window.get());
    isovalue->setFocus();
    isovalue->selectAll();
    QTest::keyClicks(isovalue, "250");
    save_as(folder / "value.marrow");
    EXPECT_EQ(viewer::read_session(folder / "value.marrow").parameters.surfaces[1].isovalue, 250);
    EXPECT_FALSE(session().has_unsaved_work());
    type_name("femur");
    save_as(folder / "name.marrow");
    EXPECT_EQ(viewer::read_session(folder / "name.marrow").parameters.surfaces[1].name, "femur");
    EXPECT_FALSE(session().has_unsaved_work());
    type_name("tibia");
    window->close();
    EXPECT_TRUE(window->isVisible());
    EXPECT_TRUE(question());
    EXPECT_EQ(session().current()->name, "tibia");
}

TEST_F(Sessions, AreNotSavedYetIfTheyChangeWhileTheirNameIsAskedFor) {
    session().add_surface({}, 100, {}, 1);
    save_as(folder / "mine.marrow", [&] { session().set_isovalue(200); });
    EXPECT_EQ(viewer::read_session(folder / "mine.marrow").parameters.surfaces[1].isovalue, 100);
    EXPECT_EQ(session().current()->isovalue, 200);
    EXPECT_TRUE(session().has_unsaved_work());
    save_as(folder / "other.marrow");
    EXPECT_FALSE(session().has_unsaved_work());
}

TEST_F(Sessions, MeasurementsAreATable) {
    work();
    write_measurements(session().parameters().measurements, folder / "m.csv");
    EXPECT_EQ(read_file(folder / "m.csv"),
              "number,kind,value,unit,x1,y1,z1,x2,y2,z2,x3,y3,z3\n"
              "1,distance,4.85412196,mm,1.25,2,3,4,6,3,,,\n"
              "2,angle,90,degrees,0,0,0,1,0,0,1,1,0\n");
    // In a scan of micrometres, too, which may be far from the origin.
    viewer::write_measurements({{{{50.0003, 0, 0}, {50.0009, 0.0003, 0}}}}, folder / "m.csv");
    EXPECT_EQ(read_file(folder / "m.csv"),
              "number,kind,value,unit,x1,y1,z1,x2,y2,z2,x3,y3,z3\n"
              "1,distance,0.000670820393,mm,50.0003,0,0,50.0009,0.0003,0,,,\n");
}

// Also if it was typed without its extension, the existing file is only replaced after a question.
TEST_F(Sessions, FilesGetTheirExtensionAndAreNotReplacedSilently) {
    write_file(folder / "old.marrow", "precious");
    int questions = 0;
    const auto choose = [&](const char* name, const char* answer) {
        QTimer user;  // answers the dialogs, which wait for it
        QObject::connect(&user, &QTimer::timeout, [&] {
            QWidget* dialog = QApplication::activeModalWidget();
            if (auto* files = qobject_cast<QFileDialog*>(dialog)) {
                files->findChild<QLineEdit*>("fileNameEdit")->setText((folder / name).c_str());
                QMetaObject::invokeMethod(files, "accept");
            } else if (auto* box = qobject_cast<QMessageBox*>(dialog)) {
                ++questions;
                for (QAbstractButton* button : box->buttons()) {
                    if (button->text().remove('&') == answer) button->click();
                }
            }
        });
        user.start(50);
        return viewer::choose_file_to_save(window.get(), "Save session", (folder / "x").c_str(), "Sessions",
                                           ".marrow")
            .toStdString();
    };
    EXPECT_EQ(choose("new", ""), (folder / "new.marrow").string());
    EXPECT_EQ(choose("new.marrow", ""), (folder / "new.marrow").string());
    EXPECT_EQ(questions, 0);
    EXPECT_EQ(choose("old", "Cancel"), "");
    EXPECT_EQ(choose("old", "Replace"), (folder / "old.marrow").string());
    EXPECT_EQ(choose("old.marrow", "Replace"), (folder / "old.marrow").string());
    EXPECT_EQ(questions, 3);
}

TEST_F(Sessions, ThePictureIsOnTheClipboard) {
    key(Qt::Key_C, Qt::ControlModifier);
    const QImage image = QApplication::clipboard()->image();
    ASSERT_FALSE(image.isNull());
    EXPECT_EQ(image.size(), view()->size() * view()->devicePixelRatioF());
    EXPECT_GT(count(image.convertToFormat(QImage::Format_RGB32), warm), 1000);
}

}  // namespace
}  // namespace marrow::test
