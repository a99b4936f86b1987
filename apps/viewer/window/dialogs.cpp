// Lays out the dialogs and reads their fields.
#include "dialogs.h"

#include <algorithm>
#include <array>
#include <iterator>

#include <QDir>
#include <QFileDialog>
#include <QFormLayout>
#include <QGuiApplication>
#include <QHBoxLayout>
#include <QMessageBox>
#include <QVBoxLayout>

#include "shared/output_checks.h"
#include "shared/values.h"
#include "views/screenshots.h"

namespace marrow::viewer {
namespace {

// Asks whether to replace files; the button of that answer has the accepting role.
QMessageBox* replace_box(const QString& title, const std::vector<std::filesystem::path>& existing,
                         QWidget* parent) {
    const QString first = QString::fromStdString(existing.front().string());
    auto* box = new QMessageBox(
        QMessageBox::NoIcon, title,
        existing.size() == 1
            ? QObject::tr("%1 exists already.").arg(first)
            : QObject::tr("%1 and %2 more exist already.").arg(first, QString::number(existing.size() - 1)),
        QMessageBox::Cancel, parent);
    box->setObjectName("replace_box");
    box->setTextFormat(Qt::PlainText);
    box->setAttribute(Qt::WA_DeleteOnClose);
    box->addButton(QObject::tr("Replace"), QMessageBox::AcceptRole)->setObjectName("replace");
    return box;
}

// Accepts a dialog, but asks first if files exist that it would replace.
void accept_unless_kept(QDialog* dialog, const std::vector<std::filesystem::path>& files) {
    std::vector<std::filesystem::path> existing;
    std::error_code unreadable;  // writing will say what is wrong
    std::copy_if(files.begin(), files.end(), std::back_inserter(existing),
                 [&](const auto& file) { return std::filesystem::exists(file, unreadable); });
    if (existing.empty()) return dialog->done(QDialog::Accepted);
    QMessageBox* box = replace_box(dialog->windowTitle(), existing, dialog);
    QObject::connect(box, &QDialog::accepted, dialog, [dialog] { dialog->done(QDialog::Accepted); });
    box->open();
}

}  // namespace

QDialogButtonBox* dialog_buttons(QDialog* dialog, const QString& accept, QPushButton*& button) {
    auto* box = new QDialogButtonBox(QDialogButtonBox::Cancel);
    button = box->addButton(accept, QDialogButtonBox::AcceptRole);
    button->setDefault(true);
    button->setObjectName("accept");
    QObject::connect(box, &QDialogButtonBox::accepted, dialog, &QDialog::accept);
    QObject::connect(box, &QDialogButtonBox::rejected, dialog, &QDialog::reject);
    return box;
}

QString choose_file_to_save(QWidget* parent, const QString& title, const QString& proposed,
                            const QString& kind, const QString& extension) {
    // Desktops may ask about the name before it has its extension, so ask afterwards.
    QString file = QFileDialog::getSaveFileName(parent, title, proposed, kind + " (*" + extension + ")",
                                                nullptr, QFileDialog::DontConfirmOverwrite);
    if (file.isEmpty()) return file;
    if (!file.endsWith(extension)) file += extension;
    if (!QFileInfo::exists(file)) return file;
    QMessageBox* box = replace_box(title, {file.toStdString()}, parent);
    bool replaces = false;
    QObject::connect(box, &QDialog::accepted, [&] { replaces = true; });
    box->exec();
    return replaces ? file : QString();
}

SpacingDialog::SpacingDialog(const Vec3d& known, QWidget* parent) : QDialog(parent) {
    setObjectName("spacing_dialog");
    setWindowTitle(tr("Spacing of the samples"));
    auto* layout = new QVBoxLayout(this);
    layout->setContentsMargins(18, 16, 18, 16);
    layout->setSpacing(12);
    auto* text = new QLabel(tr(
        "This scan does not state how far its samples are apart. Lengths, areas and volumes depend on it."));
    text->setWordWrap(true);
    layout->addWidget(text);
    auto* form = new QFormLayout;
    form->setSpacing(9);
    const std::array labels{tr("Between columns, mm"), tr("Between rows, mm"), tr("Between slices, mm")};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        auto* field = new QLineEdit;
        field->setObjectName(QString("spacing_%1").arg(axis));
        if (known[axis] > 0)
            field->setText(QString::number(known[axis], 'g', QLocale::FloatingPointShortest));
        form->addRow(labels[axis], field);
        connect(field, &QLineEdit::textChanged, this, &SpacingDialog::follow);
        spacing_[axis] = field;
    }
    layout->addLayout(form);
    layout->addWidget(dialog_buttons(this, tr("Open"), open_));
    const auto unknown = std::find_if(spacing_.begin(), spacing_.end(),
                                      [](QLineEdit* field) { return field->text().isEmpty(); });
    (unknown != spacing_.end() ? *unknown : spacing_[0])->setFocus();
    follow();
}

Vec3d SpacingDialog::spacing() const {
    Vec3d mm;
    for (std::size_t axis = 0; axis < 3; ++axis)
        mm[axis] = apps::parse_number(spacing_[axis]->text().trimmed().toStdString()).value_or(0);
    return mm;
}

void SpacingDialog::follow() {
    const Vec3d mm = spacing();
    open_->setEnabled(std::all_of(mm.begin(), mm.end(), [](double length) { return length > 0; }));
}

ExportDialog::ExportDialog(Session& session, Surfaces& surfaces, const QString& folder, QWidget* parent)
    : QDialog(parent), session_(session), surfaces_(surfaces) {
    setObjectName("export_dialog");
    setWindowTitle(tr("Export"));
    auto* layout = new QVBoxLayout(this);
    layout->setContentsMargins(18, 16, 18, 16);
    layout->setSpacing(12);
    layout->addLayout(make_form(folder));
    auto* caption = new QLabel(tr("Command line for the same files"));
    caption->setProperty("role", "faint");
    layout->addWidget(caption);
    commands_ = new QPlainTextEdit;
    commands_->setObjectName("commands");
    commands_->setReadOnly(true);
    commands_->setMaximumHeight(64);
    layout->addWidget(commands_);
    layout->addWidget(dialog_buttons(this, tr("Export"), export_));
    connect_fields();
    follow();
}

QLayout* ExportDialog::make_form(const QString& folder) {
    auto* form = new QFormLayout;
    form->setSpacing(9);
    what_ = new QComboBox;
    what_->setObjectName("what");
    for (const SurfaceParameters& s : session_.parameters().surfaces) {
        if (!s.visible) continue;
        what_->addItem(
            QString("%1   %2").arg(surface_name(*session_.scan(), s), QString::number(s.isovalue, 'g', 6)),
            s.id);
        if (s.id == session_.parameters().current) what_->setCurrentIndex(what_->count() - 1);
    }
    if (what_->count() > 1)
        what_->addItem(tr("All %1 visible surfaces, one file each").arg(what_->count()), kAll);
    form->addRow(tr("Surface"), what_);

    format_ = new QComboBox;
    format_->setObjectName("format");
    for (const ExportFormat& format : kExportFormats)
        format_->addItem(tr(format.name), QString(format.extension));
    form->addRow(tr("Format"), format_);

    space_ = new QComboBox;
    space_->setObjectName("space");
    space_->addItem(tr("LPS: x to the left, y to posterior, as in DICOM and ITK"));
    space_->addItem(tr("RAS: x to the right, y to anterior"));
    form->addRow(tr("Axes"), space_);

    auto* file_row = new QHBoxLayout;
    file_ = new QLineEdit(QDir(folder).filePath(chosen() ? file_for(*chosen()) : QString()));
    file_->setObjectName("file");
    file_->setMinimumWidth(420);
    browse_ = new QPushButton(tr("Browse…"));
    browse_->setObjectName("browse");
    browse_->setAutoDefault(false);
    file_row->addWidget(file_, 1);
    file_row->addWidget(browse_);
    form->addRow(tr("Save to"), file_row);
    size_ = new QLabel;
    size_->setObjectName("size");
    size_->setTextFormat(Qt::PlainText);
    size_->setProperty("role", "faint");
    form->addRow(QString(), size_);
    return form;
}

void ExportDialog::connect_fields() {
    connect(browse_, &QPushButton::clicked, this, &ExportDialog::browse);
    connect(what_, qOverload<int>(&QComboBox::currentIndexChanged), this, [this] {
        const QFileInfo before(file_->text());
        const QString folder = before.isDir() ? before.filePath() : before.path();
        file_->setText(chosen() ? QDir(folder).filePath(file_for(*chosen())) : folder);
        follow();
    });
    connect(format_, qOverload<int>(&QComboBox::currentIndexChanged), this, [this] {
        if (!all()) {
            const QFileInfo before(file_->text());
            const QString name = before.completeBaseName() + QString::fromStdString(extension());
            file_->setText(QDir(before.path()).filePath(name));
        }
        follow();
    });
    connect(space_, qOverload<int>(&QComboBox::currentIndexChanged), this, &ExportDialog::follow);
    connect(file_, &QLineEdit::textChanged, this, &ExportDialog::follow);
    connect(&surfaces_, &Surfaces::shape_changed, this, &ExportDialog::follow);
    connect(&surfaces_, &Surfaces::failed, this, &ExportDialog::follow);
    // The surfaces on offer are gone.
    connect(&session_, &Session::scan_changed, this, &QDialog::reject);
}

// Does not wait for the answer, because this dialog may close before.
void ExportDialog::browse() {
    auto* browser = new QFileDialog(this, all() ? tr("Folder") : tr("Export"));
    browser->setAttribute(Qt::WA_DeleteOnClose);
    if (all()) {
        browser->setFileMode(QFileDialog::Directory);
        browser->setOption(QFileDialog::ShowDirsOnly);
        browser->setDirectory(file_->text());
    } else {
        browser->setAcceptMode(QFileDialog::AcceptSave);
        browser->setOption(QFileDialog::DontConfirmOverwrite);
        browser->selectFile(file_->text());
    }
    connect(browser, &QFileDialog::fileSelected, file_, &QLineEdit::setText);
    browser->open();
}

void ExportDialog::accept() {
    std::vector<std::filesystem::path> paths;
    for (const ExportFile& file : files()) paths.push_back(file.file);
    accept_unless_kept(this, paths);
}

QString ExportDialog::file_for(const SurfaceParameters& surface) const {
    return file_name(*session_.scan(), surface, extension());
}

std::string ExportDialog::extension() const {
    return format_->currentData().toString().toStdString();
}

Space ExportDialog::space() const {
    return space_->currentIndex() == 1 ? Space::RAS : Space::LPS;
}

std::vector<ExportFile> ExportDialog::files() const {
    const std::filesystem::path path = file_->text().toStdString();
    std::vector<ExportFile> result;
    if (chosen()) result.push_back({chosen()->id, path});
    if (!all()) return result;
    for (const SurfaceParameters& surface : session_.parameters().surfaces) {
        if (!surface.visible) continue;
        // Two surfaces may have the same name.
        std::filesystem::path file = path / file_for(surface).toStdString();
        for (int n = 2;
             std::any_of(result.begin(), result.end(), [&](const ExportFile& f) { return f.file == file; });
             ++n)
            file = path / (file_name(*session_.scan(), surface, "").toStdString() + "-" + std::to_string(n) +
                           extension());
        result.push_back({surface.id, file});
    }
    return result;
}

QString ExportDialog::commands() const {
    return commands_->toPlainText();
}

void ExportDialog::follow() {
    const Scan* scan = session_.scan();
    if (!scan) return;
    QStringList lines;
    std::optional<double> bytes = 0;
    QString obstacle =
        what_->count() == 0 ? tr("All surfaces are hidden. Show one to export it.") : QString();
    for (const ExportFile& file : files()) {
        const SurfaceParameters* surface = session_.parameters().find(file.surface);
        if (!surface) continue;
        lines << shell_line(command_arguments(*scan, session_.parameters(), *surface, file.file, space()));
        const std::shared_ptr<const Shape> shape = surfaces_.exact(file.surface);
        if (!shape) {
            const QString failure = surfaces_.failure(file.surface);
            obstacle = failure.isEmpty() ? tr("Extracting the surface in full resolution…") : failure;
            continue;
        }
        if (shape->mesh->triangles.empty())
            obstacle = tr("“%1” is empty. There is no surface at isovalue %2.")
                           .arg(surface_name(*scan, *surface), QString::number(surface->isovalue, 'g', 6));
        const auto size =
            estimated_bytes(apps::lower_case(file.file.extension().string()), shape->mesh->points.size(),
                            shape->mesh->triangles.size(), session_.parameters().colouring != Colouring::own);
        bytes = bytes && size ? std::optional(*bytes + *size) : std::nullopt;
        try {
            if (apps::has_fixed_axes(mesh_format(file.file)) && space() == Space::RAS)
                obstacle = tr("This format defines its own axes. Choose LPS.");
            if (apps::has_placeholder(file.file))
                obstacle =
                    tr("The command line would read braces in this name as a placeholder. Leave them out.");
        } catch (const InputError& error) {
            obstacle = QString::fromUtf8(error.what());
        }
    }
    commands_->setPlainText(lines.join("\n"));
    size_->setText(!obstacle.isEmpty() ? obstacle
                   : bytes             ? tr("About %1").arg(size_text(*bytes))
                                       : tr("The size is not known in advance"));
    export_->setEnabled(obstacle.isEmpty() && !file_->text().isEmpty());
}

ScreenshotDialog::ScreenshotDialog(bool turntable, const QSize& size, const QString& file, QWidget* parent)
    : QDialog(parent), turntable_(turntable) {
    setObjectName("screenshot_dialog");
    setWindowTitle(turntable ? tr("Save turntable") : tr("Save screenshot"));
    auto* layout = new QVBoxLayout(this);
    layout->setContentsMargins(18, 16, 18, 16);
    layout->setSpacing(12);
    auto* form = new QFormLayout;
    form->setSpacing(9);
    layout->addLayout(form);
    const auto number = [&](const char* name, const QString& label, int lowest, int highest, int value) {
        auto* box = new QSpinBox;
        box->setObjectName(name);
        box->setRange(lowest, highest);
        box->setButtonSymbols(QAbstractSpinBox::NoButtons);
        box->setValue(value);
        form->addRow(label, box);
        return box;
    };
    width_ = number("width", tr("Width, pixels"), 16, 4096, size.width());
    height_ = number("height", tr("Height, pixels"), 16, 4096, size.height());
    frames_ = number("frames", tr("Number of images"), 2, 3600, 72);
    frames_->setVisible(turntable);
    form->labelForField(frames_)->setVisible(turntable);
    auto* row = new QHBoxLayout;
    file_ = new QLineEdit(file);
    file_->setObjectName("file");
    file_->setMinimumWidth(380);
    auto* browse = new QPushButton(tr("Browse…"));
    browse->setAutoDefault(false);
    row->addWidget(file_, 1);
    row->addWidget(browse);
    form->addRow(turntable ? tr("Folder") : tr("Save to"), row);
    QPushButton* accept = nullptr;
    layout->addWidget(dialog_buttons(this, tr("Save"), accept));
    connect(browse, &QPushButton::clicked, this, [this, turntable] {
        const QString chosen =
            turntable
                ? QFileDialog::getExistingDirectory(this, tr("Folder"), file_->text())
                : QFileDialog::getSaveFileName(this, tr("Save screenshot"), file_->text(), "PNG (*.png)",
                                               nullptr, QFileDialog::DontConfirmOverwrite);
        if (!chosen.isEmpty()) file_->setText(chosen);
    });
}

void ScreenshotDialog::accept() {
    if (file().isEmpty()) return;
    if (!turntable_ && !file().endsWith(".png")) file_->setText(file() + ".png");
    const std::filesystem::path path = file().toStdString();
    if (!turntable_) return accept_unless_kept(this, {path});
    std::vector<std::filesystem::path> images;
    for (int frame = 0; frame < frames(); ++frame) images.push_back(turntable_image(path, frame));
    accept_unless_kept(this, images);
}

}  // namespace marrow::viewer
