// Builds the window and reacts to the user, the loader and the writer.
#include "main_window.h"

#include <utility>

#include <QApplication>
#include <QClipboard>
#include <QCloseEvent>
#include <QDir>
#include <QFileDialog>
#include <QMessageBox>
#include <QMimeData>
#include <QScreen>
#include <QScrollArea>
#include <QSettings>
#include <QStackedLayout>
#include <QStatusBar>
#include <QVBoxLayout>

#include "help.h"
#include "model/measurement_table.h"
#include "panel_wheel.h"
#include "series_dialog.h"
#include "shared/library_options.h"
#include "shared/sample_text.h"
#include "theme.h"
#include "views/view_menus.h"

namespace marrow::viewer {
namespace fs = std::filesystem;
namespace {

constexpr int kRecent = 8;       // scans in the menu
constexpr QSize kFrame{16, 48};  // pixels that the window manager may need around the window

QString from_path(const fs::path& path) {
    return QString::fromStdString(path.string());
}

// A message of the library as a sentence.
QString sentence(QString message) {
    message[0] = message[0].toUpper();
    return message.endsWith('.') ? message : message + '.';
}

}  // namespace

MainWindow::MainWindow(std::optional<std::size_t> device, QWidget* parent)
    : QMainWindow(parent), surfaces_(session_, device), writer_(this) {
    setWindowTitle("Marrow Viewer");
    setAcceptDrops(true);
    resize(QSize(1440, 900).boundedTo(screen()->availableSize() - kFrame));
    fields_ = new FieldKeys(this);
    actions_ = new Actions(this, session_);
    make_views();
    banner_ = new Banner(this, stack_);
    make_status_bar();
    connect_actions();
    connect_views();
    connect_loader();
    connect_writer();
    restore_settings();
    welcome_->setFocus();
}

MainWindow::~MainWindow() {
    turning_.stop();
    // The views refer to members, which are destroyed before the child widgets would be.
    delete stack_;
}

void MainWindow::make_views() {
    views_ = new ViewLayout(session_, surfaces_);
    view_ = views_->surface_view();
    for (QMenu* menu : {make_layout_menu(*views_, this), make_slab_menu(*views_, this)})
        actions_->view_menu()->addMenu(menu);
    panel_ = new SidePanel(session_, surfaces_, (*actions_)["whole_scan"]);
    new PanelWheel(panel_);
    auto* panel_scroll = new QScrollArea;
    panel_scroll->setWidget(panel_);
    panel_scroll->setWidgetResizable(true);
    panel_scroll->setHorizontalScrollBarPolicy(Qt::ScrollBarAlwaysOff);
    panel_scroll->setMinimumWidth(240);
    columns_ = new QSplitter(Qt::Horizontal);
    columns_->addWidget(panel_scroll);
    columns_->addWidget(views_);
    columns_->setStretchFactor(1, 1);
    columns_->setSizes({260, 1120});
    controls_ = new ControlBar(session_, (*actions_)["copy"]);
    rows_ = new QSplitter(Qt::Vertical);
    rows_->addWidget(columns_);
    rows_->addWidget(controls_);
    rows_->setStretchFactor(0, 1);
    rows_->setSizes({640, 190});
    rows_->setCollapsible(0, false);
    for (QSplitter* splitter : {columns_, rows_}) splitter->setHandleWidth(2);

    welcome_ = new Welcome((*actions_)["open_folder"], (*actions_)["open"]);
    stack_ = new QStackedWidget;
    stack_->addWidget(welcome_);
    stack_->addWidget(rows_);
    // The views exist below the welcome page until the first scan opens, so that OpenGL and the layout are
    // ready then.
    static_cast<QStackedLayout*>(stack_->layout())->setStackingMode(QStackedLayout::StackAll);
    rows_->setEnabled(false);
    auto* centre = new QWidget;
    auto* layout = new QVBoxLayout(centre);
    layout->setContentsMargins(0, 0, 0, 0);
    layout->setSpacing(0);
    layout->addWidget(actions_->tool_bar());
    layout->addWidget(stack_, 1);
    setCentralWidget(centre);
}

void MainWindow::make_status_bar() {
    facts_ = new QLabel;
    facts_->setObjectName("facts");
    facts_->setTextFormat(Qt::PlainText);
    facts_->setContentsMargins(8, 0, 0, 0);
    statusBar()->addWidget(facts_, 1);
    device_ = new QLabel;
    device_->setObjectName("device");
    device_->setTextFormat(Qt::PlainText);
    device_->setContentsMargins(0, 0, 8, 0);
    device_->setToolTip(tr("What extracts the surfaces (marrow view --device)"));
    progress_ = new QProgressBar;
    progress_->setRange(0, 1000);
    progress_->setTextVisible(false);
    progress_->setFixedWidth(220);
    cancel_ = new QToolButton;
    cancel_->setObjectName("cancel");
    cancel_->setText(tr("Cancel"));
    cancel_->setToolTip(tr("Cancel (Esc)"));
    remarks_ = new QToolButton;
    remarks_->setObjectName("remarks");
    remarks_->setText(tr("ⓘ Remarks"));
    remarks_->setToolTip(tr("Show what is unusual about this scan or the last export again"));
    connect(remarks_, &QToolButton::clicked, this,
            [this] { banner_->show_message(remarks_text_, Severity::information); });
    remarks_->hide();
    statusBar()->addPermanentWidget(device_);
    statusBar()->addPermanentWidget(remarks_);
    statusBar()->addPermanentWidget(progress_);
    statusBar()->addPermanentWidget(cancel_);
    statusBar()->setSizeGripEnabled(false);
    progress_->hide();
    cancel_->hide();
    show_device({});
}

void MainWindow::restore_settings() {
    const QSettings settings;
    restoreGeometry(settings.value("geometry").toByteArray());
    columns_->restoreState(settings.value("panel").toByteArray());
    views_->restore(settings.value("views").toMap());
    rows_->restoreState(settings.value("rows").toByteArray());
    export_folder_ = settings.value("export_folder", QDir::homePath()).toString();
    if (settings.value("light", false).toBool()) (*actions_)["light"]->trigger();
    fill_recent();
}

void MainWindow::connect_actions() {
    const auto on = [this](const char* name, auto slot) {
        connect((*actions_)[name], &QAction::triggered, this, slot);
    };
    on("open", [this] { choose_scan(false); });
    on("open_folder", [this] { choose_scan(true); });
    on("export", [this] { export_surface(); });
    const auto on_picture = [&](const char* name, auto slot) {
        on(name, [this, slot] {
            if (pictures_)
                return banner_->show_message(tr("A picture is already being taken."), Severity::error);
            slot();
        });
    };
    on_picture("screenshot", [this] { save_screenshot(); });
    on_picture("frames", [this] { save_turntable(); });
    on_picture("copy_picture", [this] {
        take_pictures(
            1, view_->size() * view_->devicePixelRatioF(),
            [](const QImage& picture, int) { QApplication::clipboard()->setImage(picture); },
            tr("Copied the 3D view."));
    });
    on("save_session", [this] { choose_session_file(); });
    on("save_measurements", [this] { save_measurements(); });
    on("quit", [this] { close(); });
    on("copy", [this] {
        QApplication::clipboard()->setText(command());
        banner_->show_message(tr("Copied: %1").arg(command()), Severity::note);
    });
    on("rename", [this] { panel_->rename_current_surface(); });
    on("keys", [this] { show_keys(this); });
    on("about", [this] { show_about(this); });
    on("reset", [this] {
        view_->reset_view();
        for (const Plane plane : {Plane::axial, Plane::coronal, Plane::sagittal})
            slice_view(plane)->reset_view();
    });
    for (std::size_t i = 0; i < kSideActions.size(); ++i)
        on(kSideActions[i], [this, i] { view_->look_from(Side(i)); });
    on("light", [this](bool light) {
        apply_theme(*qApp, light);
        view_->set_light_background(light);
    });
    on("crosshair", [this](bool shown) { view_->set_crosshair_visible(shown); });
    on("full_screen", [this](bool full) { full ? showFullScreen() : showNormal(); });
    on("turntable", [this](bool turn) {
        turn ? turning_.start(33) : turning_.stop();
        view_->set_moving(turn);
    });
    connect(&turning_, &QTimer::timeout, this, [this] { view_->turn(1.5); });
    // Actions work with what is typed into a field.
    connect(actions_, &Actions::triggered, fields_, &FieldKeys::accept);
    on("escape", [this] { cancel_or_dismiss(); });
}

void MainWindow::cancel_or_dismiss() {
    if (loader_.busy())
        loader_.cancel();
    else if (writer_.busy())
        writer_.cancel();
    else if (pictures_)
        pictures_->cancel();
    else if (!session_.picked().empty())
        session_.clear_picked();
    else if (session_.tool() != Tool::navigate)
        session_.set_tool(Tool::navigate);
    else
        banner_->hide();
}

void MainWindow::connect_views() {
    connect(fields_, &FieldKeys::left, this,
            [this] { (views_->alone() ? views_->alone() : view_)->setFocus(); });
    connect(controls_->histogram(), &HistogramBar::released, &surfaces_, &Surfaces::settle);
    connect(welcome_, &Welcome::chosen, this,
            [this](const QString& path) { open_instead(path.toStdString()); });
    connect(&session_, &Session::scan_changed, this, &MainWindow::follow_scan);
    connect(&session_.undo_stack(), &QUndoStack::indexChanged, this, [this] { changed_since_open_ = true; });
    connect(&session_, &Session::picking_changed, this, [this] {
        const bool measures = session_.tool() == Tool::distance || session_.tool() == Tool::angle;
        view_->setCursor(measures ? Qt::CrossCursor : Qt::ArrowCursor);
    });
    connect(&surfaces_, &Surfaces::failed, this,
            [this](const QString& message) { banner_->show_message(message, Severity::error); });
    connect(&surfaces_, &Surfaces::device_changed, this, &MainWindow::show_device);
    connect(cancel_, &QToolButton::clicked, this, [this] {
        loader_.cancel();
        writer_.cancel();
        if (pictures_) pictures_->cancel();
    });
}

void MainWindow::connect_loader() {
    connect(&loader_, &Loader::started, this, [this](const QString& name) {
        banner_->hide_unless_note();
        show_progress(tr("Opening %1…").arg(name));
    });
    connect(&loader_, &Loader::progressed, this,
            [this](double fraction) { progress_->setValue(int(1000 * fraction)); });
    connect(&loader_, &Loader::finished, this, &MainWindow::hide_progress);
    connect(&loader_, &Loader::opened, this,
            [this](const auto& input, const auto& scan, const auto& session) {
                const auto proceed = [=, this] { show_opened(input, scan, session); };
                fields_->accept();  // which is a change, too
                changed_since_open_ ? discard_work(proceed) : proceed();
            });
    connect(&loader_, &Loader::undecided, this, &MainWindow::ask);
    connect(&loader_, &Loader::failed, this,
            [this](const QString& message) { banner_->show_message(sentence(message), Severity::error); });
}

void MainWindow::connect_writer() {
    connect(&writer_, &MeshWriter::started, this, [this] { show_progress(tr("Exporting…")); });
    connect(&writer_, &MeshWriter::progressed, this,
            [this](double fraction) { progress_->setValue(int(1000 * fraction)); });
    connect(&writer_, &MeshWriter::finished, this,
            [this](const QString& message, bool error, const QString& warnings) {
                hide_progress();
                if (error)
                    banner_->show_message(message, Severity::error);
                else if (warnings.isEmpty())
                    banner_->show_message(message, Severity::note);
                else
                    inform(message + "\n" + warnings);
                emit written();
                // The window stays if it has something to say.
                const bool silent = !error && warnings.isEmpty();
                if (std::exchange(close_when_written_, false) && silent) close();
            });
}

void MainWindow::show_opened(const fs::path& input, const std::shared_ptr<const Scan>& scan,
                             const std::shared_ptr<const SavedSession>& session) {
    banner_->hide_unless_note();
    if (pictures_) pictures_->cancel();  // they would show the other scan
    session_.set_scan(scan);
    if (session) {
        session_.resume(session->parameters, session->crosshair);
        if (session->camera) view_->resume_camera(*session->camera);
    }
    session_file_ = session ? input : fs::path();
    remember(input);
    QString warnings = std::exchange(next_remark_, {});
    for (const std::string& warning : scan->info.warnings)
        warnings +=
            (warnings.isEmpty() ? "" : "\n") + sentence(QString::fromStdString(apps::name_flags(warning)));
    remarks_->hide();
    if (!warnings.isEmpty()) inform(warnings);
}

// Shows a message that the button in the status bar shows again.
void MainWindow::inform(const QString& message) {
    remarks_text_ = message;
    remarks_->show();
    banner_->show_message(message, Severity::information);
}

// A failure joins the remarks about the scan.
void MainWindow::show_device(const QString& failure) {
    device_->setText(surfaces_.device_name());
    if (failure.isEmpty()) return;
    const QString remark = tr("The CPU extracts the surfaces of this scan: %1.").arg(failure);
    inform(remarks_->isHidden() ? remark : remarks_text_ + "\n" + remark);
}

void MainWindow::show_progress(const QString& message) {
    statusBar()->clearMessage();
    facts_->setText(message);
    progress_->setValue(0);
    progress_->show();
    cancel_->show();
}

void MainWindow::hide_progress() {
    progress_->setVisible(busy());
    cancel_->setVisible(busy());
    follow_scan();
}

void MainWindow::open(const fs::path& input, const ScanOptions& options) {
    changed_since_open_ = false;
    next_remark_.clear();
    loader_.open(input, options);
}

void MainWindow::open_instead(const fs::path& input, const QString& remark) {
    discard_work([=, this] {
        open(input);
        next_remark_ = remark;
    });
}

void MainWindow::discard_work(const std::function<void()>& proceed) {
    fields_->accept();
    if (!session_.has_unsaved_work()) return proceed();
    auto* box = new QMessageBox(QMessageBox::NoIcon, tr("Save the session?"),
                                tr("The surfaces, crop box and measurements of this scan are not saved."),
                                QMessageBox::Save | QMessageBox::Discard | QMessageBox::Cancel, this);
    box->setObjectName("discard_box");
    box->setAttribute(Qt::WA_DeleteOnClose);
    connect(box, &QMessageBox::buttonClicked, this, [this, box, proceed](QAbstractButton* button) {
        const auto answer = box->standardButton(button);
        if (answer == QMessageBox::Discard || (answer == QMessageBox::Save && choose_session_file()))
            proceed();
    });
    box->open();
}

bool MainWindow::choose_session_file() {
    fs::path proposed = session_file_;
    if (proposed.empty()) {
        proposed = session_.scan()->input;
        // What follows a dot in the name of a folder, such as a UID, is no extension.
        if (!fs::is_directory(proposed)) proposed.replace_extension();
        proposed += kSessionExtension;
    }
    // Another scan may open before the answer.
    const SavedSession shown = session_to_save();
    const std::shared_ptr<const Scan> shown_scan = session_.shared_scan();
    const QString file =
        choose_file_to_save(this, tr("Save session"), from_path(proposed), tr("Sessions"), kSessionExtension);
    return !file.isEmpty() && save_session(shown, shown_scan, file.toStdString());
}

bool MainWindow::save_session(const fs::path& file) {
    return save_session(session_to_save(), session_.shared_scan(), file);
}

SavedSession MainWindow::session_to_save() const {
    const Scan& scan = *session_.scan();
    return {scan.input,           scan.options,   scan.volume.geometry().dims, session_.parameters(),
            session_.crosshair(), view_->camera()};
}

bool MainWindow::save_session(const SavedSession& saved, const std::shared_ptr<const Scan>& scan,
                              const fs::path& file) {
    try {
        write_session(saved, file);
    } catch (const std::exception& error) {
        banner_->show_message(QString::fromUtf8(error.what()), Severity::error);
        return false;
    }
    if (scan == session_.shared_scan()) {
        if (saved.parameters == session_.parameters()) session_.set_saved();
        session_file_ = file;
    }
    remember(file);
    banner_->show_message(tr("Saved %1.").arg(from_path(file)), Severity::note);
    return true;
}

void MainWindow::save_measurements() {
    // Another scan may open before the answer.
    const std::vector<Measurement> measurements = session_.parameters().measurements;
    const QString file =
        choose_file_to_save(this, tr("Save measurements"), QDir(export_folder_).filePath("measurements.csv"),
                            tr("Tables"), ".csv");
    if (file.isEmpty()) return;
    try {
        write_measurements(measurements, file.toStdString());
        banner_->show_message(tr("Wrote %1.").arg(file), Severity::note);
    } catch (const std::exception& error) {
        banner_->show_message(QString::fromUtf8(error.what()), Severity::error);
    }
}

void MainWindow::choose_scan(bool folder) {
    const QSettings settings;
    const QString last = settings.value("scan_folder", QDir::homePath()).toString();
    const QString chosen =
        folder ? QFileDialog::getExistingDirectory(this, tr("Open a folder of DICOM files or slices"), last)
               : QFileDialog::getOpenFileName(
                     this, tr("Open a scan"), last,
                     tr("Scans and sessions (*.nii *.nii.gz *.hdr *.nrrd *.nhdr *.mha *.mhd "
                        "*.dcm *.tif *.tiff *.marrow);;All files (*)"));
    if (!chosen.isEmpty()) open_instead(chosen.toStdString());
}

// Asks the user, and opens the input with the answer.
void MainWindow::ask(const OpenQuestion& question) {
    const auto open_if_accepted = [&](QDialog* dialog, auto answer) {
        dialog->setAttribute(Qt::WA_DeleteOnClose);
        connect(dialog, &QDialog::accepted, this, [this, question, answer] {
            ScanOptions options = question.options;
            answer(options);
            loader_.open(question.input, options);
        });
        dialog->open();
    };
    switch (question.about) {
        case OpenQuestion::About::series: {
            auto* dialog = new SeriesDialog(question, this);
            return open_if_accepted(dialog, [dialog](ScanOptions& options) { options = dialog->chosen(); });
        }
        case OpenQuestion::About::spacing: {
            auto* dialog = new SpacingDialog(question.report.series.front().series.spacing, this);
            return open_if_accepted(dialog,
                                    [dialog](ScanOptions& options) { options.spacing = dialog->spacing(); });
        }
        case OpenQuestion::About::uneven_slices: {
            auto* box = new QMessageBox(
                QMessageBox::NoIcon, tr("Uneven slices"),
                tr("The slices of this scan are not evenly spaced. Interpolate them to even spacing?"),
                QMessageBox::Cancel, this);
            box->setObjectName("uneven_box");
            box->setDefaultButton(box->addButton(tr("Interpolate"), QMessageBox::AcceptRole));
            return open_if_accepted(box, [](ScanOptions& options) { options.resample = true; });
        }
    }
}

void MainWindow::remember(const fs::path& input) {
    QSettings settings;
    const QString path = from_path(absolute_path(input));
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
    QMenu* menu = actions_->recent();
    menu->clear();
    for (const QString& path : recent)
        menu->addAction(QString(path).replace('&', "&&"), this,
                        [this, path] { open_instead(path.toStdString()); });
    menu->setEnabled(!recent.isEmpty());
    welcome_->set_recent(recent);
}

void MainWindow::follow_scan() {
    const Scan* scan = session_.scan();
    if (!scan) {
        facts_->clear();
        return;
    }
    if (!rows_->isEnabled()) {  // the first scan
        rows_->setEnabled(true);
        stack_->setCurrentWidget(rows_);
        static_cast<QStackedLayout*>(stack_->layout())->setStackingMode(QStackedLayout::StackOne);
        view_->setFocus();
    }
    const Geometry& g = scan->volume.geometry();
    const QString name = from_path(scan->input.filename());
    setWindowTitle(tr("%1 – Marrow Viewer").arg(name));
    const auto samples =
        QString::fromStdString(apps::sample_text(scan->volume.type(), scan->volume.rescale()));
    QStringList size, spacing;
    for (std::size_t a = 0; a < 3; ++a) {
        size << QString::number(g.dims[a]);
        spacing << QString::number(g.spacing[a], 'g', 4);
    }
    QString format = scan_format_name(scan->info.format);
    if (!scan->info.series.modality.empty())
        format += " " + QString::fromStdString(scan->info.series.modality);
    // Joined, because a name may have the placeholders of QString::arg.
    facts_->setText(
        QStringList{name, format, size.join(" × "), spacing.join(" × ") + " mm", samples}.join("    "));
}

void MainWindow::dragEnterEvent(QDragEnterEvent* event) {
    if (event->mimeData()->hasUrls()) event->acceptProposedAction();
}

void MainWindow::dropEvent(QDropEvent* event) {
    const QList<QUrl> urls = event->mimeData()->urls();
    if (urls.empty() || !urls.front().isLocalFile()) return;
    event->acceptProposedAction();
    const fs::path first = urls.front().toLocalFile().toStdString();
    QString remark;
    if (urls.size() > 1)
        remark = tr("%1 items were dropped. This one was opened: %2. A DICOM file stands for its series. "
                    "To open other slices, drop their folder.")
                     .arg(QString::number(urls.size()), from_path(first.filename()));
    open_instead(first, remark);
}

void MainWindow::resizeEvent(QResizeEvent* event) {
    QMainWindow::resizeEvent(event);
    banner_->reposition();
}

// The window manager may change the state, too.
void MainWindow::changeEvent(QEvent* event) {
    QMainWindow::changeEvent(event);
    if (event->type() == QEvent::WindowStateChange) (*actions_)["full_screen"]->setChecked(isFullScreen());
}

void MainWindow::closeEvent(QCloseEvent* event) {
    fields_->accept();
    if (pictures_) {
        const bool turntable = pictures_->frames() > 1;
        pictures_->cancel();
        if (turntable) return event->ignore();  // the window says how far it came
    }
    if (writer_.busy()) {
        close_when_written_ = true;
        event->ignore();
        return;
    }
    if (!discards_ && session_.has_unsaved_work()) {
        event->ignore();
        discard_work([this] {
            discards_ = true;
            close();
        });
        return;
    }
    loader_.cancel();
    turning_.stop();
    QSettings settings;
    settings.setValue("geometry", saveGeometry());
    settings.setValue("panel", columns_->saveState());
    settings.setValue("views", views_->state());
    settings.setValue("rows", rows_->saveState());
    settings.setValue("light", view_->light_background());
    settings.setValue("export_folder", export_folder_);
    QMainWindow::closeEvent(event);
}

}  // namespace marrow::viewer
