// What the window exports: surfaces, pictures and turntables.
#include <memory>
#include <vector>

#include <QDir>
#include <QFileInfo>

#include "main_window.h"
#include "shared/output_checks.h"

namespace marrow::viewer {
namespace fs = std::filesystem;

void MainWindow::export_surface() {
    if (writer_.busy()) return banner_->show_message(tr("An export is already running."), Severity::error);
    surfaces_.settle();
    auto* dialog = new ExportDialog(session_, surfaces_, export_folder_, this);
    dialog->setAttribute(Qt::WA_DeleteOnClose);
    connect(dialog, &QDialog::accepted, this, [=, this] { write(dialog->files(), dialog->space()); });
    dialog->open();
}

void MainWindow::write(const std::vector<ExportFile>& files, Space space) {
    std::vector<MeshWriter::File> all;
    for (const ExportFile& file : files) {
        const std::shared_ptr<const Shape> shape = surfaces_.exact(file.surface);
        if (!shape || shape->mesh->triangles.empty()) {
            banner_->show_message(tr("There is no surface to export. Change the isovalue and try again."),
                                  Severity::error);
            emit written();
            return;
        }
        all.push_back({shape,
                       export_object(*session_.scan(), session_.parameters(),
                                     *session_.parameters().find(file.surface), *shape->mesh),
                       file.file});
    }
    remember_export_folder(all.front().path);
    writer_.write(std::move(all), space,
                  {session_.shared_scan(), session_.parameters().crop, session_.parameters().open,
                   session_.parameters().topology, session_.parameters().refined(),
                   session_.parameters().colouring != Colouring::own});
}

void MainWindow::remember_export_folder(const fs::path& file) {
    export_folder_ = QFileInfo(QString::fromStdString(file.string())).absolutePath();
}

void MainWindow::save_screenshot() {
    const QString proposed =
        QDir(export_folder_).filePath(file_name(*session_.scan(), *session_.current(), ".png"));
    auto* dialog = new ScreenshotDialog(false, {1600, 1200}, proposed, this);
    dialog->setAttribute(Qt::WA_DeleteOnClose);
    connect(dialog, &QDialog::accepted, this, [=, this] {
        try {
            const fs::path file = dialog->file().toStdString();
            apps::check_output(file, session_.scan()->input);
            apps::check_is_no_slice(file, session_.scan()->input, session_.scan()->info.format);
            take_pictures(
                1, dialog->image_size(),
                [this, file](const QImage& picture, int) {
                    write_png(picture, file);
                    remember_export_folder(file);
                },
                tr("Wrote %1.").arg(dialog->file()));
        } catch (const std::exception& error) {
            banner_->show_message(QString::fromUtf8(error.what()), Severity::error);
        }
    });
    dialog->open();
}

void MainWindow::save_turntable() {
    auto* dialog = new ScreenshotDialog(true, {960, 720}, export_folder_, this);
    dialog->setAttribute(Qt::WA_DeleteOnClose);
    connect(dialog, &QDialog::accepted, this,
            [=, this] { start_turntable(dialog->frames(), dialog->image_size(), dialog->file()); });
    dialog->open();
}

void MainWindow::start_turntable(int frames, const QSize& size, const QString& folder) {
    try {
        for (int frame = 0; frame < frames; ++frame) {
            const fs::path file = turntable_image(folder.toStdString(), frame);
            apps::check_output(file, session_.scan()->input);
            apps::check_is_no_slice(file, session_.scan()->input, session_.scan()->info.format);
        }
    } catch (const std::exception& error) {
        return banner_->show_message(QString::fromUtf8(error.what()), Severity::error);
    }
    show_progress(tr("Saving the turntable…"));
    take_pictures(
        frames, size,
        [folder](const QImage& picture, int frame) {
            write_png(picture, turntable_image(folder.toStdString(), frame));
        },
        tr("Wrote %1 images to %2.").arg(QString::number(frames), folder));
}

void MainWindow::take_pictures(int frames, const QSize& size, const Pictures::Use& use, const QString& done) {
    pictures_ = new Pictures(*view_, surfaces_, frames, size, use);
    // A picture that does not wait leaves the progress of other work alone.
    const auto progress_shown = std::make_shared<bool>(frames > 1);
    connect(pictures_, &Pictures::waiting, this, [=, this] {
        *progress_shown = true;
        show_progress(tr("Making the surfaces in full resolution…"));
    });
    connect(pictures_, &Pictures::progressed, this, [this, frames](int taken) {
        facts_->setText(tr("Image %1 of %2").arg(taken).arg(frames));
        progress_->setValue(1000 * taken / frames);
    });
    connect(pictures_, &Pictures::finished, this, [=, this](int taken, const QString& error) {
        pictures_ = nullptr;
        if (*progress_shown) hide_progress();
        if (!error.isEmpty())
            banner_->show_message(error, Severity::error);
        else if (taken == frames)
            banner_->show_message(done, Severity::note);
        else if (frames == 1)
            banner_->show_message(tr("Cancelled. There is no picture."), Severity::note);
        else
            banner_->show_message(tr("Turntable cancelled. Wrote %1 of %2 images.").arg(taken).arg(frames),
                                  Severity::note);
    });
    pictures_->start();
}

}  // namespace marrow::viewer
