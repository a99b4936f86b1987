// Tests which widget has the keyboard, and the names in the list of surfaces.
#include <QClipboard>
#include <QDoubleSpinBox>
#include <QLineEdit>
#include <QSlider>
#include <QSpinBox>
#include <QToolButton>

#include "support/viewer_ball.h"

namespace marrow::test {
namespace {

class Fields : public BallViewer {
  protected:
    // Types into the widget that has the keyboard, as a user does.
    void type(const char* text) {
        for (const char* c = text; *c; ++c) press(*c >= 'a' && *c <= 'z' ? *c - 'a' + Qt::Key_A : *c, *c);
    }
    void press(int key, char text = 0) {
        QApplication::setActiveWindow(window.get());
        QWidget* focus = QApplication::focusWidget();
        const QString typed = text ? QString(QChar(text)) : QString();
        QTest::sendKeyEvent(QTest::Press, focus ? focus : window.get(), Qt::Key(key), typed, Qt::NoModifier);
        focus = QApplication::focusWidget();  // the key may have moved the keyboard
        QTest::sendKeyEvent(QTest::Release, focus ? focus : window.get(), Qt::Key(key), typed,
                            Qt::NoModifier);
    }
    static void turn_wheel_over(QWidget* field) {
        const QPoint at = field->rect().center();
        QWheelEvent up(at, field->mapToGlobal(at), {}, {0, 120}, Qt::NoButton, Qt::NoModifier,
                       Qt::NoScrollPhase, false);
        QApplication::sendEvent(field, &up);
    }
    // Holds a key down, which repeats it.
    static void hold(QWidget* field, int key) {
        for (const bool repeats : {false, true, true, true, true}) {
            QKeyEvent down(QEvent::KeyPress, key, Qt::NoModifier, {}, repeats);
            QApplication::sendEvent(field, &down);
        }
        QKeyEvent up(QEvent::KeyRelease, key, Qt::NoModifier);
        QApplication::sendEvent(field, &up);
    }
    void type_isovalue(const char* text) {
        give_keyboard_to(isovalue());
        isovalue()->selectAll();
        type(text);
    }
    // Renames the first of two surfaces, but does not end that.
    void begin_to_rename_the_first(const char* text) {
        const int first = session().parameters().current;
        session().add_surface({}, 100, {}, 1);
        session().select_surface(first);
        ASSERT_TRUE(settle());
        key(Qt::Key_F2);
        type(text);
        ASSERT_TRUE(name()->hasFocus());
    }
    QDoubleSpinBox* isovalue() { return window->findChild<QDoubleSpinBox*>("isovalue"); }
    QLineEdit* name() { return window->findChild<QLineEdit*>("surface_name"); }
    void give_keyboard_to(QWidget* widget) {
        QApplication::setActiveWindow(window.get());
        widget->setFocus();
        ASSERT_TRUE(wait([&] { return widget->hasFocus(); }));
    }
};

TEST_F(Fields, EnterAcceptsTheIsovalueAndTheKeysWorkAgain) {
    give_keyboard_to(isovalue());
    isovalue()->selectAll();
    type("300");
    press(Qt::Key_Return);
    EXPECT_EQ(session().current()->isovalue, 300);
    EXPECT_TRUE(view()->hasFocus());
    type("1");
    EXPECT_EQ(session().current()->isovalue, 300);
    EXPECT_NEAR(view()->view_direction()[1], 1, 1e-6);
    EXPECT_TRUE(isovalue()->text().startsWith("300")) << isovalue()->text().toStdString();
}

TEST_F(Fields, TheIsovalueMayHaveAnExponent) {
    give_keyboard_to(isovalue());
    isovalue()->selectAll();
    type("3.5e2");
    press(Qt::Key_Return);
    EXPECT_EQ(session().current()->isovalue, 350);
    give_keyboard_to(isovalue());
    isovalue()->selectAll();
    type("25e-6");
    press(Qt::Key_Return);
    EXPECT_EQ(session().current()->isovalue, 2.5e-5);
    EXPECT_TRUE(isovalue()->text().startsWith("2.5e-05")) << isovalue()->text().toStdString();
}

TEST_F(Fields, TheWheelChangesOnlyAFieldThatHasTheKeyboard) {
    auto* components = window->findChild<QSpinBox*>("components");
    ASSERT_TRUE(components);
    give_keyboard_to(view());
    turn_wheel_over(components);
    EXPECT_EQ(session().parameters().components, 0);
    give_keyboard_to(components);
    turn_wheel_over(components);
    EXPECT_EQ(session().parameters().components, 1);
}

TEST_F(Fields, EscRestoresTheIsovalue) {
    give_keyboard_to(isovalue());
    isovalue()->selectAll();
    type("12");
    press(Qt::Key_Escape);
    EXPECT_EQ(session().current()->isovalue, 0);
    EXPECT_EQ(isovalue()->value(), 0);
    EXPECT_FALSE(isovalue()->text().contains("12")) << isovalue()->text().toStdString();
    EXPECT_TRUE(view()->hasFocus());
    EXPECT_EQ(session().undo_stack().undoText(), "isovalue");  // the one of SetUp
}

// The view that shows something gets the keyboard.
TEST_F(Fields, AreLeftWhileOnlyASliceIsShown) {
    viewer::SliceView* axial = window->slice_view(viewer::Plane::axial);
    window->views()->show_alone(axial);
    type_isovalue("250");
    press(Qt::Key_Return);
    EXPECT_EQ(session().current()->isovalue, 250);
    EXPECT_TRUE(axial->hasFocus());
    type_isovalue("12");
    press(Qt::Key_Escape);
    EXPECT_EQ(session().current()->isovalue, 250);
    EXPECT_EQ(isovalue()->value(), 250);
    EXPECT_TRUE(axial->hasFocus());
    type("d");
    EXPECT_EQ(session().tool(), viewer::Tool::distance);
}

TEST_F(Fields, ActionsWorkWithWhatIsTyped) {
    session().apply_preset("bone");
    type_isovalue("250");
    window->findChild<QAction*>("copy")->trigger();
    EXPECT_TRUE(QApplication::clipboard()->text().contains("--isovalue 250"))
        << QApplication::clipboard()->text().toStdString();
    session().apply_preset("bone");
    type_isovalue("250");
    key(Qt::Key_S, Qt::ControlModifier);
    auto* dialog = window->findChild<viewer::ExportDialog*>("export_dialog");
    ASSERT_TRUE(dialog);
    EXPECT_TRUE(dialog->findChild<QLineEdit*>("file")->text().endsWith("surface.stl"));
    dialog->reject();

    const int first = session().parameters().current;
    session().add_surface({}, 600, {}, 1);
    session().select_surface(first);
    type_isovalue("300");
    window->findChild<QAction*>("next_surface")->trigger();
    EXPECT_EQ(session().parameters().find(first)->isovalue, 300);
    EXPECT_EQ(session().current()->isovalue, 600);
    EXPECT_EQ(isovalue()->value(), 600);
}

TEST_F(Fields, UndoTakesBackATypedName) {
    begin_to_rename_the_first("femur");
    const int steps = session().undo_stack().count();
    QTest::mouseClick(window->findChild<QToolButton*>("undo_button"), Qt::LeftButton);
    EXPECT_EQ(session().undo_stack().count(), steps + 1);
    EXPECT_EQ(session().undo_stack().index(), steps);
    EXPECT_EQ(session().current()->name, "");
    EXPECT_EQ(session().parameters().surfaces.size(), 2u);
    window->findChild<QAction*>("redo")->trigger();
    EXPECT_EQ(session().current()->name, "femur");
    EXPECT_EQ(session().parameters().surfaces.size(), 2u);
    EXPECT_FALSE(session().undo_stack().canRedo());
}

// Each change is a step of its own, and undo goes back through them in their order.
// A mouse would take the keyboard from the name first, but assistive programs press buttons without one.
TEST_F(Fields, ANameIsEditedWhileOtherSurfacesComeAndGo) {
    begin_to_rename_the_first("fem");
    const int steps = session().undo_stack().count();
    window->findChildren<QToolButton*>("remove")[1]->click();
    EXPECT_EQ(session().parameters().surfaces.size(), 1u);
    EXPECT_EQ(session().undo_stack().count(), steps + 1);
    EXPECT_TRUE(name()->hasFocus()) << "removed";
    session().undo_stack().undo();
    EXPECT_EQ(session().parameters().surfaces.size(), 2u);
    EXPECT_TRUE(name()->hasFocus()) << "undone";
    session().undo_stack().redo();
    EXPECT_EQ(session().parameters().surfaces.size(), 1u);
    ASSERT_TRUE(name()->hasFocus());
    type("ur");
    press(Qt::Key_Return);
    EXPECT_EQ(session().current()->name, "femur");
    EXPECT_EQ(session().undo_stack().count(), steps + 2);
    session().undo_stack().undo();
    EXPECT_EQ(session().current()->name, "");
    EXPECT_EQ(session().parameters().surfaces.size(), 1u);
    session().undo_stack().undo();
    EXPECT_EQ(session().parameters().surfaces.size(), 2u);
    QTest::qWait(1);  // deletes the rows of surfaces that are gone
    EXPECT_EQ(window->findChildren<QLineEdit*>("surface_name").size(), 2);
}

TEST_F(Fields, EachKeyAndEachTypedValueIsAStepOfUndo) {
    const auto isovalue_after = [&](int back) {
        for (int i = 0; i < back; ++i) session().undo_stack().undo();
        return session().current()->isovalue;
    };
    session().set_isovalue(100.5);
    session().end_step();
    give_keyboard_to(window->histogram_bar());
    press(Qt::Key_Right);
    press(Qt::Key_PageUp);
    EXPECT_EQ(session().current()->isovalue, 111.5);
    EXPECT_EQ(isovalue_after(1), 101.5);
    give_keyboard_to(isovalue());
    press(Qt::Key_Up);
    EXPECT_EQ(session().current()->isovalue, 102.5);
    isovalue()->selectAll();
    type("300");
    press(Qt::Key_Return);
    EXPECT_EQ(session().current()->isovalue, 300);
    EXPECT_EQ(isovalue_after(1), 102.5);
    EXPECT_EQ(isovalue_after(1), 101.5);
    EXPECT_EQ(isovalue_after(1), 100.5);

    auto* opacity = window->findChild<QSlider*>("opacity");
    give_keyboard_to(opacity);
    press(Qt::Key_Left);
    press(Qt::Key_PageDown);
    EXPECT_EQ(session().current()->opacity, 0.89);
    session().undo_stack().undo();
    EXPECT_EQ(session().current()->opacity, 0.99);
    session().undo_stack().undo();
    EXPECT_EQ(session().current()->opacity, 1);
}

// Neither the wheel nor a key of the histogram, and no other field.
TEST_F(Fields, NothingJoinsTheStepOfATypedValue) {
    for (const auto& [typed, next] : {std::pair{"isovalue", "isovalue"},
                                      {"isovalue", "histogram"},
                                      {"smooth", "smooth"},
                                      {"crop_x0", "crop_x0"},
                                      {"crop_x0", "crop_y0"}}) {
        auto* field = window->findChild<QAbstractSpinBox*>(typed);
        auto* other = window->findChild<QWidget*>(next);
        ASSERT_TRUE(field && other) << next;
        give_keyboard_to(field);
        field->selectAll();
        type("9");
        press(Qt::Key_Return);
        const int steps = session().undo_stack().index();
        give_keyboard_to(other);
        field == other || other->inherits("QSpinBox") ? turn_wheel_over(other) : press(Qt::Key_Right);
        EXPECT_EQ(session().undo_stack().index(), steps + 1) << typed << ", " << next;
        session().undo_stack().undo();
        EXPECT_EQ(field->property("value").toDouble(), 9) << typed << ", " << next;
        session().undo_stack().undo();
    }
}

TEST_F(Fields, AKeyIsOneStepOfUndoWhileItIsHeld) {
    session().set_isovalue(100.5);
    for (const char* name : {"isovalue", "crop_x0", "components", "smooth", "opacity"}) {
        auto* field = window->findChild<QWidget*>(name);
        ASSERT_TRUE(field) << name;
        give_keyboard_to(field);
        const double before = field->property("value").toDouble();
        const double sign = std::string(name) == "opacity" ? -1 : 1;
        const int key = sign > 0 ? Qt::Key_Up : Qt::Key_Down, steps = session().undo_stack().index();
        hold(field, key);
        EXPECT_EQ(session().undo_stack().index(), steps + 1) << name;
        EXPECT_GE(sign * (field->property("value").toDouble() - before), 4) << name;
        for (int i = 0; i < 3; ++i) press(key);
        EXPECT_EQ(session().undo_stack().index(), steps + 4) << name;
        hold(field, key);
        EXPECT_EQ(session().undo_stack().index(), steps + 5) << name;
        for (int i = 0; i < 5; ++i) session().undo_stack().undo();
        EXPECT_EQ(field->property("value").toDouble(), before) << name;
    }
}

TEST_F(Fields, ShowsAnIsovalueBeyondAllSamples) {
    session().set_isovalue(session().scan()->histogram.lower - 300.5);
    EXPECT_EQ(isovalue()->value(), session().current()->isovalue);
}

TEST_F(Fields, AClickOnTheNameSelectsTheSurface) {
    const int first = session().parameters().current;
    session().add_surface("core", 600, {}, 1);
    ASSERT_TRUE(settle());
    const QPoint at = name()->geometry().center();
    EXPECT_EQ(name()->parentWidget()->childAt(at), nullptr);  // the row gets the click
    QTest::mouseClick(name()->parentWidget(), Qt::LeftButton, Qt::NoModifier, at);
    EXPECT_EQ(session().parameters().current, first);
    EXPECT_FALSE(name()->hasFocus());
    type("w");
    EXPECT_EQ(session().parameters().mode, viewer::DrawMode::edges);
}

TEST_F(Fields, ADoubleClickRenames) {
    QApplication::setActiveWindow(window.get());
    QWidget* row = name()->parentWidget();
    QTest::mouseDClick(row, Qt::LeftButton, Qt::NoModifier, name()->geometry().center());
    ASSERT_TRUE(wait([&] { return name()->hasFocus(); }));
    type("left femur");
    press(Qt::Key_Return);
    EXPECT_EQ(session().current()->name, "left femur");
    type("w");
    EXPECT_EQ(session().current()->name, "left femur");
    EXPECT_EQ(session().parameters().mode, viewer::DrawMode::edges);
    // F2 too, and Esc restores the name.
    key(Qt::Key_F2);
    type("right");
    press(Qt::Key_Escape);
    EXPECT_EQ(session().current()->name, "left femur");
    EXPECT_EQ(name()->text(), "left femur");
    EXPECT_TRUE(view()->hasFocus());
}

// The samples are integers, and an isovalue between them meets no sample.
TEST_F(Fields, TheHistogramChoosesIsovaluesBetweenIntegers) {
    viewer::HistogramBar* histogram = window->histogram_bar();
    const int y = histogram->height() / 2;
    for (const double value : {-1000.0, -300.2, 10.0, 500.7, 1000.0}) {
        const QPoint at(qRound(histogram->x_of(value)), y);
        QTest::mouseClick(histogram, Qt::LeftButton, Qt::NoModifier, at);
        const double isovalue = session().current()->isovalue;
        EXPECT_EQ(isovalue - std::floor(isovalue), 0.5);
        EXPECT_LT(std::abs(histogram->x_of(isovalue) - at.x()), 2);
    }
    session().set_isovalue(300.5);
    histogram->setFocus();
    QTest::keyClick(histogram, Qt::Key_Right);
    EXPECT_EQ(session().current()->isovalue, 301.5);
    QTest::keyClick(histogram, Qt::Key_PageDown);
    EXPECT_EQ(session().current()->isovalue, 291.5);
}

// Its ticks and bins are then closer together than the values that a double can have.
TEST_F(Fields, TheHistogramShowsValuesThatHardlyDiffer) {
    const auto open_doubles = [&](double first, double second) {
        std::string text =
            "NRRD0005\ntype: double\ndimension: 3\nsizes: 8 8 8\nspacings: 1 1 1\n"
            "endian: little\nencoding: raw\n\n";
        for (int i = 0; i < 8 * 8 * 8; ++i) {
            const double sample = i % 8 < 4 ? first : second;
            text.append(reinterpret_cast<const char*>(&sample), sizeof sample);
        }
        write_file(folder / "doubles.nrrd", text);
        return open(folder / "doubles.nrrd");
    };
    ASSERT_TRUE(open_doubles(0.3, 0.1 + 0.2));
    window->histogram_bar()->repaint();
    ASSERT_TRUE(open_doubles(1000, 1000 + 1e-10));
    viewer::HistogramBar* histogram = window->histogram_bar();
    for (int i = 0; i < 60; ++i) {
        const QPoint at(300, 60);
        QWheelEvent zoom(at, histogram->mapToGlobal(at), {}, {0, 120}, Qt::NoButton, Qt::NoModifier,
                         Qt::NoScrollPhase, false);
        QApplication::sendEvent(histogram, &zoom);
        histogram->repaint();
    }
    EXPECT_LT(histogram->value_at(300), histogram->value_at(310));
}

TEST_F(Fields, TheHistogramShowsTheIsovalueWhereverItIsSet) {
    viewer::HistogramBar* histogram = window->histogram_bar();
    for (const double isovalue : {5000.0, -3000.0, 0.0}) {
        session().set_isovalue(isovalue);
        EXPECT_LE(histogram->value_at(0), isovalue);
        EXPECT_GE(histogram->value_at(histogram->width()), isovalue);
    }
}

// A name that nobody gave follows the isovalue.
TEST_F(Fields, NamesFollowTheIsovalue) {
    EXPECT_EQ(name()->text(), "surface");
    session().apply_preset("bone");
    EXPECT_EQ(name()->text(), "bone");
    EXPECT_TRUE(window->command().contains("bone.stl"));
    session().set_isovalue(24);
    EXPECT_EQ(name()->text(), "surface");
    EXPECT_TRUE(window->command().contains("surface.stl"));
    key(Qt::Key_F2);
    type("mine");
    press(Qt::Key_Return);
    session().apply_preset("bone");
    EXPECT_EQ(name()->text(), "mine");
}

}  // namespace
}  // namespace marrow::test
