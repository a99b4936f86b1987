#include "main_window.h"

#include <presets.h>
#include <QApplication>
#include <QBuffer>
#include <QClipboard>
#include <QCloseEvent>
#include <QDir>
#include <QFileDialog>
#include <QGridLayout>
#include <QMenuBar>
#include <QMessageBox>
#include <QMimeData>
#include <QScrollArea>
#include <QSettings>
#include <QSignalBlocker>
#include <QStatusBar>
#include <QStyle>
#include <QToolBar>

#include <marrow/atomic_file.h>

namespace marrow::viewer {
namespace fs = std::filesystem;
namespace {

constexpr int kRecent = 8;

// Shows as many digits as the value has.
class IsovalueBox : public QDoubleSpinBox {
  public:
    QString textFromValue(double value) const override { return QString::number(value, 'g', 10); }
};

QString from_path(const fs::path& path) {
    return QString::fromStdString(path.string());
}

void write_png(const QImage& image, const fs::path& file) {
    QByteArray bytes;
    QBuffer buffer(&bytes);
    buffer.open(QIODevice::WriteOnly);
    if (!image.save(&buffer, "PNG")) throw IoError("cannot make a PNG of this size: choose a smaller one");
    AtomicFile out(file);
    out.write(bytes.constData(), static_cast<std::size_t>(bytes.size()));
    out.commit();
}

}  // namespace

MainWindow::MainWindow(QWidget* parent) : QMainWindow(parent) {
    setWindowTitle("Marrow Viewer");
    setAcceptDrops(true);
    resize(1440, 900);

    view_ = new SurfaceView(session_, surfaces_);
    view_->setObjectName("surface_view");
    slice_column_ = new QSplitter(Qt::Vertical);
    for (const Plane plane : {Plane::axial, Plane::coronal, Plane::sagittal}) {
        auto* slice = new SliceView(session_, plane);
        slice->setObjectName(plane == Plane::axial     ? "axial"
                             : plane == Plane::coronal ? "coronal"
                                                       : "sagittal");
        slices_[static_cast<std::size_t>(plane)] = slice;
        slice_column_->addWidget(slice);
    }
    panel_ = new Panel(session_, surfaces_);
    auto* panel_scroll = new QScrollArea;
    panel_scroll->setWidget(panel_);
    panel_scroll->setWidgetResizable(true);
    panel_scroll->setHorizontalScrollBarPolicy(Qt::ScrollBarAlwaysOff);
    panel_scroll->setMinimumWidth(240);
    columns_ = new QSplitter(Qt::Horizontal);
    columns_->addWidget(panel_scroll);
    columns_->addWidget(view_);
    columns_->addWidget(slice_column_);
    columns_->setStretchFactor(1, 1);
    columns_->setSizes({260, 800, 320});
    histogram_ = new HistogramBar(session_);
    histogram_->setObjectName("histogram");
    rows_ = new QSplitter(Qt::Vertical);
    rows_->addWidget(columns_);
    rows_->addWidget(make_bottom());
    rows_->setStretchFactor(0, 1);
    rows_->setSizes({640, 190});
    rows_->setCollapsible(0, false);
    for (QSplitter* splitter : {columns_, slice_column_, rows_}) splitter->setHandleWidth(2);

    make_actions();
    stack_ = new QStackedWidget;
    stack_->addWidget(make_welcome());
    stack_->addWidget(rows_);
    setCentralWidget(stack_);
    make_menus();
    make_tool_bar();
    make_banner();

    facts_ = new QLabel;
    facts_->setObjectName("facts");
    facts_->setContentsMargins(8, 0, 0, 0);
    statusBar()->addWidget(facts_, 1);
    progress_ = new QProgressBar;
    progress_->setRange(0, 1000);
    progress_->setTextVisible(false);
    progress_->setFixedWidth(220);
    cancel_ = new QToolButton;
    cancel_->setObjectName("cancel");
    cancel_->setText(tr("Cancel"));
    cancel_->setToolTip(tr("Stop (Esc)"));
    statusBar()->addPermanentWidget(progress_);
    statusBar()->addPermanentWidget(cancel_);
    statusBar()->setSizeGripEnabled(false);
    progress_->hide();
    cancel_->hide();

    connect_all();
    const QSettings settings;
    restoreGeometry(settings.value("geometry").toByteArray());
    columns_->restoreState(settings.value("columns").toByteArray());
    slice_column_->restoreState(settings.value("slices").toByteArray());
    rows_->restoreState(settings.value("rows").toByteArray());
    export_folder_ = settings.value("export_folder", QDir::homePath()).toString();
    if (settings.value("light", false).toBool()) actions_["light"]->trigger();
    fill_recent();
    follow_parameters();
}

MainWindow::~MainWindow() {
    turning_.stop();
    // The views refer to the session and the surfaces, which are members and go before child widgets would.
    delete stack_;
}

QAction* MainWindow::action(const QString& name, const QString& text, const QKeySequence& shortcut,
                            const QString& tip) {
    auto* result = new QAction(text, this);
    result->setObjectName(name);
    result->setShortcut(shortcut);
    result->setToolTip(shortcut.isEmpty() ? tip
                                          : tip + "  (" + shortcut.toString(QKeySequence::NativeText) + ")");
    addAction(result);
    actions_[name] = result;
    return result;
}

void MainWindow::make_actions() {
    action("open", tr("Open file…"), QKeySequence::Open, tr("Open a NIfTI, NRRD, MetaImage or DICOM file"));
    action("open_folder", tr("Open folder…"), QKeySequence("Ctrl+Shift+O"),
           tr("Open a folder of DICOM files or slices"));
    action("export", tr("Export…"), QKeySequence("Ctrl+S"),
           tr("Write the surface as STL, 3MF, PLY, OBJ, VTP or GLB"));
    action("screenshot", tr("Screenshot…"), QKeySequence("Ctrl+P"),
           tr("Save the 3D view as a picture of any size"));
    action("frames", tr("Turntable as pictures…"), {}, tr("Save a turn as a row of PNG pictures"));
    action("quit", tr("Quit"), QKeySequence::Quit, tr("Quit"));

    QAction* undo = session_.undo_stack().createUndoAction(this, tr("Undo"));
    undo->setObjectName("undo");
    undo->setShortcut(QKeySequence::Undo);
    QAction* redo = session_.undo_stack().createRedoAction(this, tr("Redo"));
    redo->setObjectName("redo");
    redo->setShortcuts({QKeySequence("Ctrl+Shift+Z"), QKeySequence("Ctrl+Y")});
    actions_["undo"] = undo;
    actions_["redo"] = redo;
    addActions({undo, redo});
    action("copy", tr("Copy command line"), QKeySequence("Ctrl+Shift+C"),
           tr("Copy the command line that writes this surface"));

    const auto group = [&](QActionGroup*& g) { g = new QActionGroup(this); };
    const auto choice = [&](QActionGroup* g, const QString& name, const QString& text,
                            const QKeySequence& key, const QString& tip, int value) {
        QAction* a = action(name, text, key, tip);
        a->setCheckable(true);
        a->setData(value);
        g->addAction(a);
    };
    group(modes_);
    choice(modes_, "surface", tr("Surface"), QKeySequence("S"), tr("Smooth surface"), int(DrawMode::surface));
    choice(modes_, "edges", tr("Edges"), {}, tr("Surface with the triangles' edges"), int(DrawMode::edges));
    choice(modes_, "wireframe", tr("Wire"), {}, tr("Wireframe"), int(DrawMode::wireframe));
    choice(modes_, "points", tr("Points"), {}, tr("Points"), int(DrawMode::points));
    action("cycle", tr("Next way of drawing"), QKeySequence("W"), tr("Surface, edges, wireframe, points"));
    group(tools_);
    choice(tools_, "navigate", tr("Navigate"), QKeySequence("N"), tr("Click moves the crosshair"),
           int(Tool::navigate));
    choice(tools_, "distance", tr("Distance"), QKeySequence("D"),
           tr("Click two positions, on the surface or on slices"), int(Tool::distance));
    choice(tools_, "angle", tr("Angle"), QKeySequence("A"),
           tr("Click three positions; the angle is at the second"), int(Tool::angle));
    group(cuts_);
    choice(cuts_, "no_cut", tr("No cut"), {}, tr("Show whole surfaces"), -1);
    choice(cuts_, "cut_axial", tr("Axial cut"), {}, tr("Cut along the axial slice"), int(Plane::axial));
    choice(cuts_, "cut_coronal", tr("Coronal cut"), {}, tr("Cut along the coronal slice"),
           int(Plane::coronal));
    choice(cuts_, "cut_sagittal", tr("Sagittal cut"), {}, tr("Cut along the sagittal slice"),
           int(Plane::sagittal));
    action("cycle_cut", tr("Next cut"), QKeySequence("C"),
           tr("No cut, axial, coronal, sagittal: through the crosshair"));
    action("flip_cut", tr("Other side of the cut"), QKeySequence("F"), tr("Show the other side of the cut"));

    action("reset", tr("Reset view"), QKeySequence("R"), tr("See all, from the front left"));
    const std::array<std::tuple<const char*, const char*, const char*, const char*>, 6> sides{{
        {"anterior", "A", "1", QT_TR_NOOP("From the front (anterior)")},
        {"posterior", "P", "2", QT_TR_NOOP("From behind (posterior)")},
        {"left", "L", "3", QT_TR_NOOP("From the patient's left")},
        {"right", "R", "4", QT_TR_NOOP("From the patient's right")},
        {"superior", "S", "5", QT_TR_NOOP("From above (superior)")},
        {"inferior", "I", "6", QT_TR_NOOP("From below (inferior)")},
    }};
    int side = 0;
    for (const auto& [name, letter, key, tip] : sides) {
        QAction* a = action(name, tr(tip), QKeySequence(key), tr(tip));
        a->setIconText(letter);
        connect(a, &QAction::triggered, this, [this, s = Side(side++)] { view_->look_from(s); });
    }
    action("turntable", tr("Turntable"), QKeySequence("T"), tr("Turn the patient slowly"))
        ->setCheckable(true);
    QAction* crosshair = action("crosshair", tr("Crosshair in 3D"), QKeySequence("X"),
                                tr("Show the crosshair in the 3D view"));
    crosshair->setCheckable(true);
    crosshair->setChecked(true);
    action("light", tr("Light background"), QKeySequence("B"), tr("Light or dark behind the surfaces"))
        ->setCheckable(true);
    action("full_screen", tr("Full screen"), QKeySequence("F11"), tr("Full screen"))->setCheckable(true);
    action("keys", tr("Keys and mouse"), QKeySequence("F1"), tr("Keys and mouse"));
    action("about", tr("About Marrow Viewer"), {}, tr("About"));
    for (const auto& [name, text] : {std::pair{"open_folder", tr("Open")},
                                     {"reset", tr("Reset")},
                                     {"turntable", tr("Turn")},
                                     {"screenshot", tr("Picture")},
                                     {"export", tr("Export")}})
        actions_[name]->setIconText(text);
    action("escape", tr("Cancel"), QKeySequence("Esc"), tr("Stop what is under way"));

    struct WindowPreset {
        const char* name;
        double centre, width;
    };
    // Centre and width in HU, as most workstations have them.
    for (const WindowPreset& preset : {WindowPreset{QT_TR_NOOP("Bone"), 300, 1500},
                                       {QT_TR_NOOP("Soft tissue"), 40, 400},
                                       {QT_TR_NOOP("Brain"), 40, 80},
                                       {QT_TR_NOOP("Lung"), -600, 1500}}) {
        QAction* a =
            action(QString("window_%1").arg(preset.name).toLower().replace(' ', '_'),
                   tr("%1: %2 ± %3 HU").arg(tr(preset.name)).arg(preset.centre).arg(preset.width / 2), {},
                   tr("Window of the slices"));
        connect(a, &QAction::triggered, this, [this, preset] {
            session_.change(tr("window"), {}, [&](Parameters& p) {
                p.window = {preset.centre, preset.width};
            });
        });
    }
    QAction* full = action("window_full", tr("All values"), {}, tr("From the lowest to the highest value"));
    connect(full, &QAction::triggered, this, [this] {
        if (!session_.scan()) return;
        const Histogram& h = session_.scan()->histogram;
        session_.change(tr("window"), {}, [&](Parameters& p) {
            p.window = {(h.lower + h.upper) / 2, std::max(h.upper - h.lower, 1e-6)};
        });
    });
}

void MainWindow::make_menus() {
    QMenu* file = menuBar()->addMenu(tr("&File"));
    file->addAction(actions_["open"]);
    file->addAction(actions_["open_folder"]);
    recent_ = file->addMenu(tr("Open recent"));
    file->addSeparator();
    for (const char* name : {"export", "screenshot", "frames"}) file->addAction(actions_[name]);
    file->addSeparator();
    file->addAction(actions_["quit"]);
    QMenu* edit = menuBar()->addMenu(tr("&Edit"));
    for (const char* name : {"undo", "redo", "copy"}) edit->addAction(actions_[name]);
    QMenu* show = menuBar()->addMenu(tr("&View"));
    for (const char* name : {"surface", "edges", "wireframe", "points", "cycle"})
        show->addAction(actions_[name]);
    show->addSeparator();
    for (const char* name : {"reset", "anterior", "posterior", "left", "right", "superior", "inferior"})
        show->addAction(actions_[name]);
    show->addSeparator();
    for (const char* name : {"turntable", "crosshair", "light", "full_screen"})
        show->addAction(actions_[name]);
    QMenu* cut = menuBar()->addMenu(tr("&Cut"));
    for (const char* name : {"no_cut", "cut_axial", "cut_coronal", "cut_sagittal"})
        cut->addAction(actions_[name]);
    cut->addSeparator();
    for (const char* name : {"cycle_cut", "flip_cut"}) cut->addAction(actions_[name]);
    QMenu* measure = menuBar()->addMenu(tr("&Measure"));
    for (const char* name : {"navigate", "distance", "angle"}) measure->addAction(actions_[name]);
    QMenu* window = menuBar()->addMenu(tr("&Window"));
    for (const char* name :
         {"window_bone", "window_soft_tissue", "window_brain", "window_lung", "window_full"})
        window->addAction(actions_[name]);
    QMenu* help = menuBar()->addMenu(tr("&Help"));
    help->addAction(actions_["keys"]);
    help->addAction(actions_["about"]);
}

void MainWindow::make_tool_bar() {
    QToolBar* bar = addToolBar(tr("Tools"));
    bar->setObjectName("tools");
    bar->setMovable(false);
    bar->setContextMenuPolicy(Qt::PreventContextMenu);
    const auto button = [&](const char* name) {
        auto* b = new QToolButton;
        b->setDefaultAction(actions_[name]);
        b->setToolButtonStyle(Qt::ToolButtonTextOnly);
        b->setFocusPolicy(Qt::TabFocus);
        bar->addWidget(b);
        return b;
    };
    QToolButton* open = button("open_folder");
    open->setPopupMode(QToolButton::InstantPopup);
    auto* ways = new QMenu(open);
    ways->addActions({actions_["open"], actions_["open_folder"]});
    ways->addMenu(recent_);
    open->setMenu(ways);
    bar->addSeparator();
    actions_["undo"]->setIconText(tr("Undo"));
    actions_["redo"]->setIconText(tr("Redo"));
    for (const char* name : {"undo", "redo"}) button(name);
    bar->addSeparator();
    for (const char* name : {"surface", "edges", "wireframe", "points"}) button(name);
    bar->addSeparator();
    for (const char* name : {"anterior", "posterior", "left", "right", "superior", "inferior"})
        button(name)->setObjectName("side");
    button("reset");
    bar->addSeparator();
    for (const char* name : {"navigate", "distance", "angle"}) button(name);
    bar->addSeparator();
    auto* cut = new QToolButton;
    cut->setObjectName("cut");
    cut->setText(tr("Cut"));
    cut->setToolTip(actions_["cycle_cut"]->toolTip());
    cut->setPopupMode(QToolButton::InstantPopup);
    cut->setCheckable(true);
    auto* cut_menu = new QMenu(cut);
    cut_menu->addActions(cuts_->actions());
    cut_menu->addSeparator();
    cut_menu->addAction(actions_["flip_cut"]);
    cut->setMenu(cut_menu);
    bar->addWidget(cut);
    connect(&session_, &Session::parameters_changed, cut,
            [this, cut] { cut->setChecked(session_.parameters().cut.plane.has_value()); });
    button("turntable");
    auto* space = new QWidget;
    space->setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Preferred);
    bar->addWidget(space);
    button("screenshot");
    button("export")->setObjectName("export");
}

QWidget* MainWindow::make_welcome() {
    auto* page = new QWidget;
    page->setObjectName("welcome");
    page->setAttribute(Qt::WA_StyledBackground);
    auto* layout = new QVBoxLayout(page);
    layout->addStretch(3);
    const auto centred = [&](const QString& text, const char* role) {
        auto* label = new QLabel(text);
        label->setProperty("role", role);
        label->setAlignment(Qt::AlignCenter);
        layout->addWidget(label);
    };
    centred(tr("Open a scan"), "title");
    layout->addSpacing(6);
    centred(tr("Drop a DICOM folder or a NIfTI, NRRD or MetaImage file here."), "faint");
    layout->addSpacing(22);
    auto* row = new QHBoxLayout;
    row->addStretch();
    for (const auto& [name, text] :
         {std::pair{"open_folder", tr("Open folder…")}, {"open", tr("Open file…")}}) {
        auto* b = new QPushButton(text);
        b->setToolTip(actions_[name]->toolTip());
        b->setDefault(QString(name) == "open_folder");
        connect(b, &QPushButton::clicked, actions_[name], &QAction::trigger);
        row->addWidget(b);
    }
    row->addStretch();
    layout->addLayout(row);
    layout->addSpacing(24);
    welcome_recent_ = new QWidget;
    new QVBoxLayout(welcome_recent_);
    layout->addWidget(welcome_recent_, 0, Qt::AlignHCenter);
    layout->addStretch(4);
    centred(tr("For research use only. Not a medical device."), "faint");
    layout->addSpacing(8);
    return page;
}

QWidget* MainWindow::make_bottom() {
    auto* bottom = new QWidget;
    bottom->setObjectName("bottom");
    bottom->setAttribute(Qt::WA_StyledBackground);
    auto* layout = new QVBoxLayout(bottom);
    layout->setContentsMargins(14, 8, 14, 8);
    layout->setSpacing(5);
    auto* top = new QHBoxLayout;
    top->setSpacing(6);
    auto* label = new QLabel(tr("Isovalue"));
    label->setProperty("role", "heading");
    top->addWidget(label);
    isovalue_ = new IsovalueBox;
    isovalue_->setObjectName("isovalue");
    isovalue_->setKeyboardTracking(false);
    isovalue_->setButtonSymbols(QAbstractSpinBox::NoButtons);
    isovalue_->setToolTip(tr("The surface is where samples reach this value"));
    isovalue_->setMinimumWidth(120);
    isovalue_->setLocale(QLocale::c());
    top->addWidget(isovalue_);
    top->addSpacing(10);
    const auto chip = [&](const QString& name, const QString& tip) {
        auto* b = new QPushButton(name);
        b->setObjectName("chip");
        b->setCheckable(true);
        b->setToolTip(tip);
        b->setAutoDefault(false);
        top->addWidget(b);
        chips_.push_back(b);
        return b;
    };
    for (const Preset& preset : kPresets) {
        const QString name = QString::fromUtf8(preset.name.data(), static_cast<int>(preset.name.size()));
        connect(chip(name, tr("%1 HU; only for CT").arg(preset.lowest)), &QPushButton::clicked, this,
                [this, name] {
                    session_.apply_preset(name);
                    follow_parameters();
                });
    }
    connect(chip("otsu", tr("Where Otsu's method parts the values in two")), &QPushButton::clicked, this,
            [this] {
                session_.seal();
                if (session_.scan() && session_.scan()->otsu) session_.set_isovalue(*session_.scan()->otsu);
                session_.seal();
                follow_parameters();
            });
    top->addStretch();
    layout->addLayout(top);
    layout->addWidget(histogram_, 1);
    auto* line = new QHBoxLayout;
    line->setSpacing(6);
    command_ = new QLineEdit;
    command_->setObjectName("command");
    command_->setReadOnly(true);
    command_->setToolTip(tr("This command writes the same bytes as Export"));
    auto* copy = new QToolButton;
    copy->setObjectName("copy_command");
    copy->setText(tr("Copy"));
    copy->setToolTip(tr("Copy the command line"));
    connect(copy, &QToolButton::clicked, this, [this] { actions_["copy"]->trigger(); });
    line->addWidget(command_, 1);
    line->addWidget(copy);
    layout->addLayout(line);
    return bottom;
}

void MainWindow::make_banner() {
    banner_ = new QFrame(this);
    banner_->setObjectName("banner");
    auto* layout = new QHBoxLayout(banner_);
    layout->setContentsMargins(14, 8, 8, 8);
    banner_text_ = new QLabel;
    banner_text_->setObjectName("banner_text");
    banner_text_->setWordWrap(true);
    banner_text_->setTextInteractionFlags(Qt::TextSelectableByMouse);
    layout->addWidget(banner_text_, 1);
    auto* close = new QToolButton;
    close->setText("×");
    close->setToolTip(tr("Hide"));
    layout->addWidget(close, 0, Qt::AlignTop);
    connect(close, &QToolButton::clicked, banner_, &QWidget::hide);
    banner_timer_.setSingleShot(true);
    connect(&banner_timer_, &QTimer::timeout, banner_, &QWidget::hide);
    banner_->hide();
}

QString MainWindow::banner() const {
    return banner_->isHidden() ? QString() : banner_text_->text();
}

void MainWindow::say(const QString& sentence, bool error) {
    banner_text_->setText(sentence);
    banner_->setProperty("kind", error ? "error" : "note");
    banner_->style()->unpolish(banner_);
    banner_->style()->polish(banner_);
    banner_->show();
    banner_->raise();
    place_banner();
    error ? banner_timer_.stop() : banner_timer_.start(6000);
}

void MainWindow::place_banner() {
    const int wide = std::min(760, width() - 80);
    banner_->setFixedWidth(wide);
    banner_->adjustSize();
    const QPoint corner = centralWidget()->mapTo(this, QPoint(0, 0));
    banner_->move((width() - wide) / 2, corner.y() + 12);
}

void MainWindow::resizeEvent(QResizeEvent* event) {
    QMainWindow::resizeEvent(event);
    place_banner();
}

void MainWindow::connect_all() {
    const auto on = [this](const char* name, auto slot) {
        connect(actions_[name], &QAction::triggered, this, slot);
    };
    on("open", [this] { choose_scan(false); });
    on("open_folder", [this] { choose_scan(true); });
    on("export", [this] { export_surface(); });
    on("screenshot", [this] { save_picture(); });
    on("frames", [this] { save_turntable(); });
    on("quit", [this] { close(); });
    on("copy", [this] {
        QApplication::clipboard()->setText(command_->text());
        say(tr("Copied: %1").arg(command_->text()), false);
    });
    on("keys", [this] { show_keys(); });
    on("about", [this] { show_about(); });
    on("reset", [this] {
        view_->reset_view();
        for (SliceView* slice : slices_) slice->reset_view();
    });
    on("light", [this](bool light) { view_->set_light_background(light); });
    on("crosshair", [this](bool shown) { view_->set_crosshair_visible(shown); });
    on("full_screen", [this](bool full) { full ? showFullScreen() : showNormal(); });
    on("turntable", [this](bool turn) {
        turn ? turning_.start(33) : turning_.stop();
        view_->set_moving(turn);
    });
    connect(&turning_, &QTimer::timeout, this, [this] { view_->turn(1.5); });
    on("cycle", [this] {
        session_.change(tr("way of drawing"), {},
                        [](Parameters& p) { p.mode = DrawMode((int(p.mode) + 1) % 4); });
    });
    on("cycle_cut", [this] {
        session_.change(tr("cut"), {}, [](Parameters& p) {
            const int next = p.cut.plane ? int(*p.cut.plane) + 1 : 0;
            p.cut.plane = next < 3 ? std::optional(Plane(next)) : std::nullopt;
        });
    });
    on("flip_cut", [this] {
        session_.change(tr("side of the cut"), {}, [](Parameters& p) { p.cut.flipped = !p.cut.flipped; });
    });
    on("escape", [this] {
        if (loader_.busy())
            loader_.cancel();
        else if (!session_.picked().empty())
            session_.drop_picked();
        else if (session_.tool() != Tool::navigate)
            session_.set_tool(Tool::navigate);
        else
            banner_->hide();
    });
    connect(modes_, &QActionGroup::triggered, this, [this](QAction* a) {
        session_.change(tr("way of drawing"), {},
                        [&](Parameters& p) { p.mode = DrawMode(a->data().toInt()); });
    });
    connect(tools_, &QActionGroup::triggered, this,
            [this](QAction* a) { session_.set_tool(Tool(a->data().toInt())); });
    connect(cuts_, &QActionGroup::triggered, this, [this](QAction* a) {
        const int plane = a->data().toInt();
        session_.change(tr("cut"), {}, [&](Parameters& p) {
            p.cut.plane = plane < 0 ? std::nullopt : std::optional(Plane(plane));
        });
    });
    connect(isovalue_, qOverload<double>(&QDoubleSpinBox::valueChanged), this,
            [this](double value) { session_.set_isovalue(value); });
    connect(isovalue_, &QDoubleSpinBox::editingFinished, this, [this] { session_.seal(); });
    connect(histogram_, &HistogramBar::released, &surfaces_, &Surfaces::settle);

    connect(&session_, &Session::scan_changed, this, &MainWindow::follow_scan);
    connect(&session_, &Session::parameters_changed, this, &MainWindow::follow_parameters);
    connect(&session_, &Session::picking_changed, this, [this] {
        tools_->actions()[int(session_.tool())]->setChecked(true);
        view_->setCursor(session_.tool() == Tool::navigate ? Qt::ArrowCursor : Qt::CrossCursor);
    });
    connect(&surfaces_, &Surfaces::failed, this, [this](const QString& sentence) { say(sentence, true); });

    connect(&loader_, &Loader::started, this, [this](const QString& name) {
        statusBar()->clearMessage();
        facts_->setText(tr("Opening %1…").arg(name));
        progress_->setValue(0);
        progress_->show();
        cancel_->show();
    });
    connect(&loader_, &Loader::progressed, this,
            [this](double fraction) { progress_->setValue(int(1000 * fraction)); });
    connect(&loader_, &Loader::finished, this, [this] {
        progress_->hide();
        cancel_->hide();
        follow_scan();
    });
    connect(&loader_, &Loader::opened, this, [this](const std::shared_ptr<const Scan>& scan) {
        banner_->hide();
        session_.set_scan(scan);
        remember(*scan);
        QString warnings;
        for (const std::string& warning : scan->info.warnings)
            warnings += (warnings.isEmpty() ? "" : "\n") + QString::fromStdString(warning);
        if (!warnings.isEmpty()) say(warnings, true);
    });
    connect(&loader_, &Loader::undecided, this, &MainWindow::choose_series);
    connect(&loader_, &Loader::failed, this, [this](const QString& sentence) { say(sentence, true); });
    connect(cancel_, &QToolButton::clicked, this, [this] {
        loader_.cancel();
        writer_.forget_all();
    });
}

void MainWindow::open(const fs::path& input, const ScanOptions& options) {
    loader_.open(input, options);
}

void MainWindow::choose_scan(bool folder) {
    const QSettings settings;
    const QString last = settings.value("scan_folder", QDir::homePath()).toString();
    const QString chosen =
        folder ? QFileDialog::getExistingDirectory(this, tr("Open a folder of DICOM files or slices"), last)
               : QFileDialog::getOpenFileName(this, tr("Open a scan"), last,
                                              tr("Scans (*.nii *.nii.gz *.hdr *.nrrd *.nhdr *.mha *.mhd "
                                                 "*.dcm *.tif *.tiff);;All files (*)"));
    if (!chosen.isEmpty()) open(chosen.toStdString());
}

void MainWindow::choose_series(const fs::path& input, const ScanOptions& options, const ScanReport& report) {
    auto* dialog = new SeriesDialog(report, this);
    dialog->setAttribute(Qt::WA_DeleteOnClose);
    connect(dialog, &QDialog::accepted, this, [=, this] {
        ScanOptions with_series = options;
        with_series.series = dialog->chosen();
        open(input, with_series);
    });
    dialog->open();
}

void MainWindow::remember(const Scan& scan) {
    if (!scan.options.series.empty() || scan.options.spacing)
        return;  // the path alone would not open it again
    QSettings settings;
    const QString path = from_path(fs::absolute(scan.input).lexically_normal());
    settings.setValue("scan_folder", QFileInfo(path).path());
    QStringList recent = settings.value("recent").toStringList();
    recent.removeAll(path);
    recent.prepend(path);
    while (recent.size() > kRecent) recent.removeLast();
    settings.setValue("recent", recent);
    fill_recent();
}

void MainWindow::fill_recent() {
    const QStringList recent = QSettings().value("recent").toStringList();
    recent_->clear();
    qDeleteAll(welcome_recent_->findChildren<QToolButton*>());
    for (const QString& path : recent) {
        const auto again = [this, path] { open(path.toStdString()); };
        recent_->addAction(path, this, again);
        auto* b = new QToolButton;
        b->setText(QFileInfo(path).fileName() + "   " + QDir::toNativeSeparators(QFileInfo(path).path()));
        connect(b, &QToolButton::clicked, this, again);
        welcome_recent_->layout()->addWidget(b);
    }
    recent_->setEnabled(!recent.isEmpty());
}

void MainWindow::follow_scan() {
    const Scan* scan = session_.scan();
    if (!scan) {
        facts_->clear();
        return;
    }
    stack_->setCurrentIndex(1);
    const Geometry& g = scan->volume.geometry();
    const QString name =
        from_path(scan->input.has_filename() ? scan->input.filename() : scan->input.parent_path().filename());
    setWindowTitle(tr("%1 – Marrow Viewer").arg(name));
    facts_->setText(QString("%1    %2%3    %4 × %5 × %6    %7 × %8 × %9 mm    %10")
                        .arg(name, QString::fromStdString(scan->info.format),
                             scan->info.series.modality.empty()
                                 ? QString()
                                 : " " + QString::fromStdString(scan->info.series.modality))
                        .arg(g.dims[0])
                        .arg(g.dims[1])
                        .arg(g.dims[2])
                        .arg(g.spacing[0], 0, 'g', 4)
                        .arg(g.spacing[1], 0, 'g', 4)
                        .arg(g.spacing[2], 0, 'g', 4)
                        .arg(sample_type_name(scan->volume.type())));
    const QSignalBlocker quiet(isovalue_);
    const double step = histogram_->step();
    isovalue_->setDecimals(step >= 1 ? 2 : std::min(12, 2 - int(std::floor(std::log10(step)))));
    isovalue_->setSingleStep(step);
    isovalue_->setRange(scan->histogram.lower, scan->histogram.upper);
    isovalue_->setSuffix(scan->hounsfield ? " HU" : "");
}

void MainWindow::follow_parameters() {
    const Parameters& p = session_.parameters();
    const Scan* scan = session_.scan();
    const SurfaceParameters* current = session_.current();
    for (const char* name :
         {"export", "screenshot", "frames", "copy", "cycle", "cycle_cut", "flip_cut", "turntable", "reset",
          "anterior", "posterior", "left", "right", "superior", "inferior", "window_full"})
        actions_[name]->setEnabled(scan != nullptr);
    for (QActionGroup* group : {modes_, tools_, cuts_}) group->setEnabled(scan != nullptr);
    for (const char* name : {"window_bone", "window_soft_tissue", "window_brain", "window_lung"})
        actions_[name]->setEnabled(scan && scan->hounsfield);
    modes_->actions()[int(p.mode)]->setChecked(true);
    cuts_->actions()[p.cut.plane ? int(*p.cut.plane) + 1 : 0]->setChecked(true);
    tools_->actions()[int(session_.tool())]->setChecked(true);
    if (!current) return;
    {
        const QSignalBlocker quiet(isovalue_);
        isovalue_->setValue(current->isovalue);
    }
    for (std::size_t i = 0; i < chips_.size(); ++i) {
        const bool preset = i < kPresets.size();
        chips_[i]->setEnabled(preset ? scan->hounsfield : scan->otsu.has_value());
        chips_[i]->setChecked(preset ? scan->hounsfield && current->isovalue == kPresets[i].isovalue()
                                     : scan->otsu && current->isovalue == *scan->otsu);
    }
    follow_command();
}

void MainWindow::follow_command() {
    const Scan* scan = session_.scan();
    const SurfaceParameters* current = session_.current();
    if (!scan || !current) return;
    command_->setText(shell_line(command_arguments(*scan, session_.parameters(), *current,
                                                   file_name(*current, ".stl").toStdString(), Space::LPS)));
    command_->setCursorPosition(0);
}

void MainWindow::export_surface() {
    if (writing_) return say(tr("An export is under way already."), true);
    surfaces_.settle();
    auto* dialog = new ExportDialog(session_, surfaces_, export_folder_, this);
    dialog->setAttribute(Qt::WA_DeleteOnClose);
    connect(dialog, &QDialog::accepted, this, [=, this] { write(dialog->files(), dialog->space()); });
    dialog->open();
}

void MainWindow::write(const std::vector<ExportFile>& files, Space space) {
    struct Part {
        std::shared_ptr<const Shape> shape;  // whose mesh the object borrows
        MeshObject object;
        fs::path file;
    };
    std::vector<Part> parts;
    for (const ExportFile& file : files) {
        const std::shared_ptr<const Shape> shape = surfaces_.exact(file.surface);
        if (!shape || shape->mesh->triangles.empty()) {
            say(tr("There is no surface to write."), true);
            emit written();
            return;
        }
        parts.push_back(
            {shape, export_object(*session_.scan(), *session_.parameters().find(file.surface), *shape->mesh),
             file.file});
    }
    writing_ = true;
    facts_->setText(tr("Exporting…"));
    progress_->setValue(0);
    progress_->show();
    cancel_->show();
    export_folder_ = from_path(parts.front().file.parent_path());
    const auto end = [this](const QString& sentence, bool error) {
        QMetaObject::invokeMethod(
            this,
            [=, this] {
                writing_ = false;
                progress_->hide();
                cancel_->hide();
                follow_scan();
                say(sentence, error);
                emit written();
            },
            Qt::QueuedConnection);
    };
    writer_.post({0, 0}, [=, this](const Progress& unless_interrupted) {
        auto told = std::chrono::steady_clock::now();
        std::size_t done = 0;
        const Progress progress = [&](double fraction) {
            const auto now = std::chrono::steady_clock::now();
            if (now - told > std::chrono::milliseconds(30)) {
                told = now;
                const double all = (static_cast<double>(done) + fraction) / static_cast<double>(parts.size());
                QMetaObject::invokeMethod(
                    this, [this, all] { progress_->setValue(int(1000 * all)); }, Qt::QueuedConnection);
            }
            return unless_interrupted(fraction);
        };
        try {
            for (; done < parts.size(); ++done)
                write_meshes({&parts[done].object, 1}, parts[done].file, {space, progress});
            QString sentence = tr("Wrote %1").arg(from_path(parts.front().file));
            if (parts.size() > 1) sentence += tr(" and %1 more").arg(parts.size() - 1);
            end(sentence + ".", false);
        } catch (const Cancelled&) {
            end(tr("Cancelled; no file was changed half-way."), false);
            throw;
        } catch (const std::exception& error) {
            end(QString::fromUtf8(error.what()), true);
        }
    });
}

void MainWindow::save_picture() {
    const QString file =
        QDir(export_folder_)
            .filePath(session_.current() ? file_name(*session_.current(), ".png") : QString("surface.png"));
    auto* dialog = new PictureDialog(false, {1600, 1200}, file, this);
    dialog->setAttribute(Qt::WA_DeleteOnClose);
    connect(dialog, &QDialog::accepted, this, [=, this] {
        try {
            write_png(view_->picture(dialog->size_of_picture()), dialog->file().toStdString());
            export_folder_ = QFileInfo(dialog->file()).path();
            say(tr("Wrote %1.").arg(dialog->file()), false);
        } catch (const std::exception& error) {
            say(QString::fromUtf8(error.what()), true);
        }
    });
    dialog->open();
}

void MainWindow::save_turntable() {
    auto* dialog = new PictureDialog(true, {960, 720}, export_folder_, this);
    dialog->setAttribute(Qt::WA_DeleteOnClose);
    connect(dialog, &QDialog::accepted, this, [=, this] {
        // One picture for each turn of the event loop, so that the window stays alive.
        struct Run {
            int frame = 0, frames;
            QSize size;
            QString folder;
        };
        auto run = std::make_shared<Run>(Run{0, dialog->frames(), dialog->size_of_picture(), dialog->file()});
        auto* timer = new QTimer(this);
        connect(timer, &QTimer::timeout, this, [=, this] {
            try {
                if (run->frame < run->frames) {
                    const QString name = QString("frame-%1.png").arg(run->frame, 4, 10, QChar('0'));
                    write_png(view_->picture(run->size), QDir(run->folder).filePath(name).toStdString());
                    view_->turn(360.0 / run->frames);
                    ++run->frame;
                    facts_->setText(tr("Picture %1 of %2").arg(run->frame).arg(run->frames));
                    return;
                }
                say(tr("Wrote %1 pictures to %2.").arg(run->frames).arg(run->folder), false);
            } catch (const std::exception& error) {
                say(QString::fromUtf8(error.what()), true);
            }
            timer->deleteLater();
            follow_scan();
        });
        timer->start(0);
    });
    dialog->open();
}

void MainWindow::show_about() {
    auto* box = new QMessageBox(this);
    box->setAttribute(Qt::WA_DeleteOnClose);
    box->setObjectName("about_box");
    box->setWindowTitle(tr("About Marrow Viewer"));
    box->setText(tr("<h3>Marrow Viewer %1</h3>").arg(MARROW_VERSION));
    box->setInformativeText(
        tr("<p>From CT and MRI scans to surfaces, by marching cubes over a histogram pyramid.</p>"
           "<p><b>For research use only.</b> Not a medical device; not for diagnosis or treatment.</p>"
           "<p>Apache License 2.0. Uses Qt %1 and VTK 9.1.</p>")
            .arg(qVersion()));
    box->open();
}

void MainWindow::show_keys() {
    auto* box = new QMessageBox(this);
    box->setAttribute(Qt::WA_DeleteOnClose);
    box->setWindowTitle(tr("Keys and mouse"));
    const std::vector<std::pair<QString, QString>> rows{
        {"W", tr("surface, edges, wireframe, points")},
        {"S", tr("surface")},
        {"R", tr("reset the views")},
        {"1 … 6", tr("from anterior, posterior, left, right, superior, inferior")},
        {"N  D  A", tr("navigate, distance, angle")},
        {"C  F", tr("next cut; its other side")},
        {"T  X  B", tr("turntable; crosshair in 3D; background")},
        {"Esc", tr("cancel")},
        {tr("3D: left, middle, right"), tr("rotate, pan, zoom; a click sets the crosshair")},
        {tr("Slice: left, middle, right"), tr("crosshair, pan, window")},
        {tr("Slice: wheel, Ctrl+wheel"), tr("through the slices, zoom")},
        {tr("Histogram: drag, arrows, pages"), tr("isovalue")}};
    QString text = "<table cellpadding='4'>";
    for (const auto& [key, what] : rows)
        text += QString("<tr><td><b>%1</b></td><td>%2</td></tr>").arg(key, what);
    box->setText(text + "</table>");
    box->open();
}

void MainWindow::dragEnterEvent(QDragEnterEvent* event) {
    if (event->mimeData()->hasUrls()) event->acceptProposedAction();
}

void MainWindow::dropEvent(QDropEvent* event) {
    const QList<QUrl> urls = event->mimeData()->urls();
    if (urls.empty() || !urls.front().isLocalFile()) return;
    event->acceptProposedAction();
    open(urls.front().toLocalFile().toStdString());
}

void MainWindow::closeEvent(QCloseEvent* event) {
    if (writing_) {
        // The file comes first, unless it is cancelled.
        connect(this, &MainWindow::written, this, &QWidget::close, Qt::UniqueConnection);
        event->ignore();
        return;
    }
    loader_.cancel();
    turning_.stop();
    QSettings settings;
    settings.setValue("geometry", saveGeometry());
    settings.setValue("columns", columns_->saveState());
    settings.setValue("slices", slice_column_->saveState());
    settings.setValue("rows", rows_->saveState());
    settings.setValue("light", view_->light_background());
    settings.setValue("export_folder", export_folder_);
    QMainWindow::closeEvent(event);
}

}  // namespace marrow::viewer
