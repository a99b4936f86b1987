/// The small dialogs of the viewer: spacing, export and screenshots.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include <QComboBox>
#include <QDialog>
#include <QDialogButtonBox>
#include <QLabel>
#include <QLayout>
#include <QLineEdit>
#include <QPlainTextEdit>
#include <QPushButton>
#include <QSpinBox>

#include "model/export_formats.h"
#include "model/surfaces.h"

namespace marrow::viewer {

/// Makes the buttons of a dialog: Cancel, and the default button `accept`, which is returned in `button`.
QDialogButtonBox* dialog_buttons(QDialog* dialog, const QString& accept, QPushButton*& button);

/// Asks for a file to write, and whether to replace it if it exists. A name without the extension gets it.
/// Returns an empty text if the user cancels.
QString choose_file_to_save(QWidget* parent, const QString& title, const QString& proposed,
                            const QString& kind, const QString& extension);

/// Asks for the spacing of a scan that does not state it.
class SpacingDialog : public QDialog {
    Q_OBJECT
  public:
    /// Proposes the lengths that are `known`, in mm; 0: unknown.
    SpacingDialog(const Vec3d& known, QWidget* parent);
    /// 0 where no number is entered.
    Vec3d spacing() const;

  private:
    void follow();

    std::array<QLineEdit*, 3> spacing_;
    QPushButton* open_;
};

/// A surface and the file to write.
struct ExportFile {
    int surface;  ///< id
    std::filesystem::path file;
};

/// Asks which visible surfaces to export, in which format, and where to.
class ExportDialog : public QDialog {
    Q_OBJECT
  public:
    ExportDialog(Session& session, Surfaces& surfaces, const QString& folder, QWidget* parent);

    std::vector<ExportFile> files() const;
    Space space() const;
    /// The displayed command lines, which write the same files.
    QString commands() const;
    void set_file(const QString& file) { file_->setText(file); }
    /// Asks before existing files are replaced.
    void accept() override;

  private:
    QLayout* make_form(const QString& folder);
    void connect_fields();
    void browse();
    void follow();
    bool all() const { return what_->currentData().toInt() == kAll; }
    /// The chosen surface; null for all of them.
    const SurfaceParameters* chosen() const {
        return session_.parameters().find(what_->currentData().toInt());
    }
    QString file_for(const SurfaceParameters& surface) const;
    std::string extension() const;

    static constexpr int kAll = -1;  // instead of an id

    Session& session_;
    Surfaces& surfaces_;
    QComboBox *what_, *format_, *space_;
    QLineEdit* file_;
    QPushButton* browse_;
    QPlainTextEdit* commands_;
    QLabel* size_;
    QPushButton* export_;
};

/// Asks for the size and the file of a screenshot, or for the frames and the folder of a turntable.
class ScreenshotDialog : public QDialog {
    Q_OBJECT
  public:
    ScreenshotDialog(bool turntable, const QSize& size, const QString& file, QWidget* parent);
    QSize image_size() const { return {width_->value(), height_->value()}; }
    int frames() const { return frames_->value(); }
    QString file() const { return file_->text(); }
    /// Asks before existing files are replaced.
    void accept() override;

  private:
    const bool turntable_;
    QSpinBox *width_, *height_, *frames_;
    QLineEdit* file_;
};

}  // namespace marrow::viewer
