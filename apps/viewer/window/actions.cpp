// Creates the actions, fills menus and tool bar, and connects actions with the session.
#include "actions.h"

#include <algorithm>
#include <utility>

#include <QHBoxLayout>
#include <QMenuBar>
#include <QToolBar>
#include <QToolButton>

#include "views/window_presets.h"

namespace marrow::viewer {
namespace {

QString window_action(const WindowPreset& preset) {
    return QString("window_%1").arg(preset.name).toLower().replace(' ', '_');
}

QString with_key(const QString& tip, const QKeySequence& key) {
    return key.isEmpty() ? tip : tip + "  (" + key.toString(QKeySequence::NativeText) + ")";
}

}  // namespace

Actions::Actions(QMainWindow* window, Session& session)
    : QObject(window), window_(window), session_(session) {
    make_file_and_edit();
    make_modes_and_tools();
    make_cuts();
    make_views();
    make_windows();
    make_menus();
    make_tool_bar();
    connect_to_session();
    connect(&session_, &Session::parameters_changed, this, &Actions::follow);
    connect(&session_, &Session::picking_changed, this, &Actions::follow);
    follow();
}

QAction* Actions::add(const QString& name, const QString& text, const QKeySequence& shortcut,
                      const QString& tip) {
    auto* result = new QAction(text, window_);
    result->setObjectName(name);
    result->setShortcut(shortcut);
    result->setToolTip(with_key(tip, shortcut));
    connect(result, &QAction::triggered, this, &Actions::triggered);  // before the slots of the action
    window_->addAction(result);
    actions_[name] = result;
    return result;
}

void Actions::make_file_and_edit() {
    add("open", tr("Open file…"), QKeySequence::Open,
        tr("Open a NIfTI, NRRD, MetaImage or DICOM file, or a session"));
    add("open_folder", tr("Open folder…"), QKeySequence("Ctrl+Shift+O"),
        tr("Open a folder of DICOM files or slices"));
    add("save_session", tr("Save session…"), QKeySequence("Ctrl+Shift+S"),
        tr("Save surfaces, crop box, measurements and views to continue later"));
    add("save_measurements", tr("Save measurements…"), {}, tr("Save the measurements as a CSV table"));
    add("export", tr("Export…"), QKeySequence("Ctrl+S"),
        tr("Export surfaces as STL, 3MF, PLY, OBJ, VTP or GLB"));
    add("screenshot", tr("Screenshot…"), QKeySequence("Ctrl+P"),
        tr("Save the 3D view as an image of any size"));
    add("frames", tr("Save turntable…"), {}, tr("Save one full turn as PNG images"));
    add("quit", tr("Quit"), QKeySequence::Quit, tr("Quit Marrow Viewer"));

    QUndoStack& stack = session_.undo_stack();
    QAction* undo = stack.createUndoAction(window_, tr("Undo"));
    undo->setObjectName("undo");
    undo->setShortcut(QKeySequence::Undo);
    undo->setToolTip(with_key(tr("Undo the last change"), undo->shortcut()));
    QAction* redo = stack.createRedoAction(window_, tr("Redo"));
    redo->setObjectName("redo");
    redo->setShortcuts({QKeySequence("Ctrl+Shift+Z"), QKeySequence("Ctrl+Y")});
    redo->setToolTip(with_key(tr("Redo what was undone"), redo->shortcut()));
    for (const auto& [action, slot] : {std::pair{undo, &QUndoStack::undo}, {redo, &QUndoStack::redo}}) {
        action->disconnect(&stack);  // and connect it after the signal
        connect(action, &QAction::triggered, this, &Actions::triggered);
        connect(action, &QAction::triggered, &stack, slot);
    }
    actions_["undo"] = undo;
    actions_["redo"] = redo;
    window_->addActions({undo, redo});
    add("copy_picture", tr("Copy picture"), QKeySequence::Copy, tr("Copy the 3D view to the clipboard"));
    add("next_surface", tr("Next surface"), QKeySequence("Ctrl+Tab"),
        tr("Select the next surface, which the histogram then controls"));
    add("rename", tr("Rename surface"), QKeySequence("F2"), tr("Change the name of the selected surface"));
    add("copy", tr("Copy command line"), QKeySequence("Ctrl+Shift+C"),
        tr("Copy the command line that exports this surface"));
    add("escape", tr("Cancel"), QKeySequence("Esc"), tr("Cancel the current operation"));
}

void Actions::add_choice(QActionGroup* group, const QString& name, const QString& text,
                         const QKeySequence& key, const QString& tip, int value) {
    QAction* action = add(name, text, key, tip);
    action->setCheckable(true);
    action->setData(value);
    group->addAction(action);
}

void Actions::make_modes_and_tools() {
    modes_ = new QActionGroup(this);
    add_choice(modes_, "surface", tr("Surface"), QKeySequence("S"), tr("Draw smooth surfaces"),
               int(DrawMode::surface));
    add_choice(modes_, "edges", tr("Edges"), {}, tr("Draw surfaces with the edges of their triangles"),
               int(DrawMode::edges));
    add_choice(modes_, "wireframe", tr("Wire"), {}, tr("Draw wireframes"), int(DrawMode::wireframe));
    add_choice(modes_, "points", tr("Points"), {}, tr("Draw points"), int(DrawMode::points));
    add("cycle", tr("Next draw mode"), QKeySequence("W"), tr("Surface, edges, wireframe, points"));
    tools_ = new QActionGroup(this);
    add_choice(tools_, "navigate", tr("Navigate"), QKeySequence("N"), tr("Click to move the crosshair"),
               int(Tool::navigate));
    add_choice(tools_, "distance", tr("Distance"), QKeySequence("D"),
               tr("Measure a distance: click two positions on a surface or a slice"), int(Tool::distance));
    add_choice(tools_, "angle", tr("Angle"), QKeySequence("A"),
               tr("Measure an angle: click three positions; the second is the vertex"), int(Tool::angle));
    add_choice(tools_, "crop", tr("Crop"), QKeySequence("K"),
               tr("Drag the sides of a box to restrict surfaces to the samples inside"), int(Tool::crop));
    add("whole_scan", tr("Reset crop"), {}, tr("Remove the crop box"));
}

void Actions::make_cuts() {
    cuts_ = new QActionGroup(this);
    add_choice(cuts_, "no_cut", tr("No cut"), {}, tr("Show complete surfaces"), -1);
    add_choice(cuts_, "cut_axial", tr("Axial cut"), {}, tr("Cut along the axial slice"), int(Plane::axial));
    add_choice(cuts_, "cut_coronal", tr("Coronal cut"), {}, tr("Cut along the coronal slice"),
               int(Plane::coronal));
    add_choice(cuts_, "cut_sagittal", tr("Sagittal cut"), {}, tr("Cut along the sagittal slice"),
               int(Plane::sagittal));
    add("cycle_cut", tr("Next cut"), QKeySequence("C"),
        tr("Cut through the crosshair: none, axial, coronal, sagittal"));
    add("flip_cut", tr("Flip cut"), QKeySequence("F"), tr("Show the other side of the cut"));
}

void Actions::make_views() {
    add("reset", tr("Reset view"), QKeySequence("R"), tr("Show everything from the front left"));
    constexpr std::array kLetters{"A", "P", "L", "R", "S", "I"};
    constexpr std::array kTips{
        QT_TR_NOOP("View from anterior (front)"),   QT_TR_NOOP("View from posterior (back)"),
        QT_TR_NOOP("View from the patient's left"), QT_TR_NOOP("View from the patient's right"),
        QT_TR_NOOP("View from superior (above)"),   QT_TR_NOOP("View from inferior (below)")};
    for (std::size_t i = 0; i < kSideActions.size(); ++i) {
        QAction* a = add(kSideActions[i], tr(kTips[i]), QKeySequence(QString::number(i + 1)), tr(kTips[i]));
        a->setIconText(kLetters[i]);
    }
    add("turntable", tr("Turntable"), QKeySequence("T"), tr("Rotate the view slowly"))->setCheckable(true);
    QAction* crosshair =
        add("crosshair", tr("Crosshair in 3D"), QKeySequence("X"), tr("Show the crosshair in the 3D view"));
    crosshair->setCheckable(true);
    crosshair->setChecked(true);
    add("light", tr("Light theme"), QKeySequence("B"), tr("Switch between a light and a dark window"))
        ->setCheckable(true);
    add("full_screen", tr("Full screen"), QKeySequence("F11"), tr("Switch full screen on or off"))
        ->setCheckable(true);
    add("keys", tr("Keys and mouse"), QKeySequence("F1"), tr("Show keys and mouse buttons"));
    add("about", tr("About Marrow Viewer"), {}, tr("Show the version and the licence"));
    for (const auto& [name, text] : {std::pair{"reset", tr("Reset")},
                                     {"turntable", tr("Turn")},
                                     {"screenshot", tr("Screenshot")},
                                     {"export", tr("Export")}})
        actions_[name]->setIconText(text);
}

void Actions::make_windows() {
    // Selects this window; the menu ticks the current one.
    const auto choose = [this](const Window& window) {
        session_.change(tr("window"), {}, [&](Parameters& p) { p.window = window; });
        follow();
    };
    for (const WindowPreset& preset : kWindowPresets) {
        QAction* a =
            add(window_action(preset), QString("%1: %2").arg(tr(preset.name), window_text(preset.window)), {},
                tr("Width and level of the slices' grey values, HU"));
        a->setCheckable(true);
        connect(a, &QAction::triggered, this, [choose, preset] { choose(preset.window); });
    }
    QAction* full =
        add("window_full", tr("All values"), {}, tr("Show values from the lowest to the highest"));
    full->setCheckable(true);
    connect(full, &QAction::triggered, this,
            [this, choose] { choose(window_of_all_values(session_.scan()->histogram)); });
}

void Actions::connect_to_session() {
    connect(actions_["cycle"], &QAction::triggered, this, [this] {
        session_.change(tr("draw mode"), {}, [](Parameters& p) { p.mode = DrawMode((int(p.mode) + 1) % 4); });
    });
    connect(actions_["cycle_cut"], &QAction::triggered, this, [this] {
        session_.change(tr("cut"), {}, [](Parameters& p) {
            const int next = p.cut.plane ? int(*p.cut.plane) + 1 : 0;
            p.cut.plane = next < 3 ? std::optional(Plane(next)) : std::nullopt;
        });
    });
    connect(actions_["flip_cut"], &QAction::triggered, this, [this] {
        session_.change(tr("flip cut"), {}, [](Parameters& p) { p.cut.flipped = !p.cut.flipped; });
    });
    connect(actions_["whole_scan"], &QAction::triggered, this,
            [this] { session_.change(tr("reset crop"), {}, [](Parameters& p) { p.crop.reset(); }); });
    connect(actions_["next_surface"], &QAction::triggered, this, [this] {
        const std::vector<SurfaceParameters>& surfaces = session_.parameters().surfaces;
        const auto current = std::find_if(surfaces.begin(), surfaces.end(), [this](const auto& surface) {
            return surface.id == session_.parameters().current;
        });
        const auto next = static_cast<std::size_t>(current - surfaces.begin() + 1) % surfaces.size();
        session_.select_surface(surfaces[next].id);
    });
    connect(modes_, &QActionGroup::triggered, this, [this](QAction* a) {
        session_.change(tr("draw mode"), {}, [&](Parameters& p) { p.mode = DrawMode(a->data().toInt()); });
    });
    connect(tools_, &QActionGroup::triggered, this,
            [this](QAction* a) { session_.set_tool(Tool(a->data().toInt())); });
    connect(cuts_, &QActionGroup::triggered, this, [this](QAction* a) {
        const int plane = a->data().toInt();
        session_.change(tr("cut"), {}, [&](Parameters& p) {
            p.cut.plane = plane < 0 ? std::nullopt : std::optional(Plane(plane));
        });
    });
}

void Actions::make_menus() {
    QMenu* file = window_->menuBar()->addMenu(tr("&File"));
    file->addAction(actions_["open"]);
    file->addAction(actions_["open_folder"]);
    recent_ = file->addMenu(tr("Open recent"));
    file->addSeparator();
    for (const char* name : {"save_session", "export", "save_measurements", "screenshot", "frames"})
        file->addAction(actions_[name]);
    file->addSeparator();
    file->addAction(actions_["quit"]);
    QMenu* edit = window_->menuBar()->addMenu(tr("&Edit"));
    for (const char* name : {"undo", "redo", "next_surface", "rename", "copy_picture", "copy"})
        edit->addAction(actions_[name]);
    QMenu* show = view_menu_ = window_->menuBar()->addMenu(tr("&View"));
    for (const char* name : {"surface", "edges", "wireframe", "points", "cycle"})
        show->addAction(actions_[name]);
    show->addSeparator();
    show->addAction(actions_["reset"]);
    for (const char* name : kSideActions) show->addAction(actions_[name]);
    show->addSeparator();
    for (const char* name : {"turntable", "crosshair", "light", "full_screen"})
        show->addAction(actions_[name]);
    QMenu* cut = window_->menuBar()->addMenu(tr("&Cut"));
    for (const char* name : {"no_cut", "cut_axial", "cut_coronal", "cut_sagittal"})
        cut->addAction(actions_[name]);
    cut->addSeparator();
    for (const char* name : {"cycle_cut", "flip_cut"}) cut->addAction(actions_[name]);
    cut->addSeparator();
    for (const char* name : {"crop", "whole_scan"}) cut->addAction(actions_[name]);
    QMenu* measure = window_->menuBar()->addMenu(tr("&Measure"));
    for (const char* name : {"navigate", "distance", "angle"}) measure->addAction(actions_[name]);
    QMenu* window = window_->menuBar()->addMenu(tr("&Window"));
    for (const char* name :
         {"window_bone", "window_soft_tissue", "window_brain", "window_lung", "window_full"})
        window->addAction(actions_[name]);
    QMenu* help = window_->menuBar()->addMenu(tr("&Help"));
    help->addAction(actions_["keys"]);
    help->addAction(actions_["about"]);
}

// A menu at the end of the tool bar holds the tools for which a narrow window has no room. Export is always
// there.
void Actions::make_tool_bar() {
    tool_bar_ = new QWidget;
    tool_bar_->setObjectName("tools");
    tool_bar_->setAttribute(Qt::WA_StyledBackground);
    auto* row = new QHBoxLayout(tool_bar_);
    row->setContentsMargins(0, 0, 10, 0);
    auto* bar = new QToolBar;
    bar->setToolButtonStyle(Qt::ToolButtonTextOnly);
    row->addWidget(bar, 1);
    const auto button = [&](QAction* action) {
        bar->addAction(action);
        auto* b = static_cast<QToolButton*>(bar->widgetForAction(action));
        b->setFocusPolicy(Qt::TabFocus);
        b->setPopupMode(QToolButton::InstantPopup);
        b->setObjectName(action->objectName() + "_button");
        return b;
    };
    button(open_menu_action());
    bar->addSeparator();
    actions_["undo"]->setIconText(tr("Undo"));
    actions_["redo"]->setIconText(tr("Redo"));
    for (const char* name : {"undo", "redo"}) button(actions_[name]);
    bar->addSeparator();
    for (const char* name : {"navigate", "distance", "angle"}) button(actions_[name]);
    bar->addSeparator();
    button(actions_["crop"]);
    button(cut_menu_action());
    bar->addSeparator();
    for (const char* name : {"surface", "edges", "wireframe", "points"}) button(actions_[name]);
    bar->addSeparator();
    for (const char* name : kSideActions) button(actions_[name])->setProperty("narrow", true);
    for (const char* name : {"reset", "turntable"}) button(actions_[name]);
    auto* space = new QWidget;
    space->setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Preferred);
    bar->addWidget(space);
    button(actions_["screenshot"]);
    auto* export_button = new QToolButton;
    export_button->setDefaultAction(actions_["export"]);
    export_button->setFocusPolicy(Qt::TabFocus);
    export_button->setObjectName("export");
    row->addWidget(export_button);
    // Qt makes this button, but its icon is black.
    auto* more = bar->findChild<QToolButton*>("qt_toolbar_ext_button");
    more->setIcon({});
    more->setText("»");
    more->setToolTip(tr("More tools"));
    more->setFocusPolicy(Qt::TabFocus);
}

QAction* Actions::open_menu_action() {
    auto* open = new QAction(tr("Open"), this);
    open->setObjectName("open_menu");
    open->setToolTip(tr("Open a scan or a session"));
    auto* ways = new QMenu(window_);
    ways->addActions({actions_["open"], actions_["open_folder"]});
    ways->addMenu(recent_);
    open->setMenu(ways);
    return open;
}

QAction* Actions::cut_menu_action() {
    auto* cut = new QAction(tr("Cut"), this);
    cut->setObjectName("cut");
    actions_["cut"] = cut;
    cut->setToolTip(actions_["cycle_cut"]->toolTip());
    cut->setCheckable(true);
    auto* cut_menu = new QMenu(window_);
    cut_menu->addActions(cuts_->actions());
    cut_menu->addSeparator();
    cut_menu->addAction(actions_["flip_cut"]);
    cut->setMenu(cut_menu);
    connect(&session_, &Session::parameters_changed, cut,
            [this, cut] { cut->setChecked(session_.parameters().cut.plane.has_value()); });
    return cut;
}

void Actions::follow() {
    const Parameters& p = session_.parameters();
    const Scan* scan = session_.scan();
    for (const char* name :
         {"save_session", "export", "screenshot", "frames", "rename", "copy_picture", "copy", "cut", "cycle",
          "cycle_cut", "flip_cut", "turntable", "reset", "window_full"})
        actions_[name]->setEnabled(scan != nullptr);
    for (const char* name : kSideActions) actions_[name]->setEnabled(scan != nullptr);
    for (QActionGroup* group : {modes_, tools_, cuts_}) group->setEnabled(scan != nullptr);
    for (const WindowPreset& preset : kWindowPresets) {
        QAction* action = actions_[window_action(preset)];
        action->setEnabled(scan && scan->hounsfield);
        action->setChecked(scan && scan->hounsfield && p.window == preset.window);
    }
    actions_["window_full"]->setChecked(scan && p.window == window_of_all_values(scan->histogram));
    actions_["next_surface"]->setEnabled(p.surfaces.size() > 1);
    actions_["whole_scan"]->setEnabled(p.crop.has_value());
    actions_["save_measurements"]->setEnabled(!p.measurements.empty());
    modes_->actions()[int(p.mode)]->setChecked(true);
    cuts_->actions()[p.cut.plane ? int(*p.cut.plane) + 1 : 0]->setChecked(true);
    tools_->actions()[int(session_.tool())]->setChecked(true);
}

}  // namespace marrow::viewer
