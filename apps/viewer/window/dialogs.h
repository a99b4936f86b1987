// The questions that the viewer asks.
#pragma once

#include <QComboBox>
#include <QDialog>
#include <QLabel>
#include <QLineEdit>
#include <QPlainTextEdit>
#include <QPushButton>
#include <QSpinBox>
#include <QTableWidget>

#include "model/export_formats.h"
#include "model/surfaces.h"

namespace marrow::viewer {

/// Which series of a folder to read. Those that cannot be read say why.
class SeriesDialog : public QDialog {
    Q_OBJECT
  public:
    SeriesDialog(const ScanReport& report, QWidget* parent);
    /// SeriesInfo::id
    std::string chosen() const;

  private:
    QTableWidget* table_;
    QPushButton* open_;
    std::vector<std::string> ids_;
};

/// One file to write.
struct ExportFile {
    int surface;
    std::filesystem::path file;
};

class ExportDialog : public QDialog {
    Q_OBJECT
  public:
    ExportDialog(Session& session, Surfaces& surfaces, const QString& folder, QWidget* parent);

    std::vector<ExportFile> files() const;
    Space space() const;
    /// The lines that write the same, as they are shown.
    QString commands() const;
    void set_file(const QString& file) { file_->setText(file); }

  private:
    void follow();
    bool all() const { return what_->currentIndex() == 1; }
    std::string ending() const;

    Session& session_;
    Surfaces& surfaces_;
    QComboBox *what_, *format_, *space_;
    QLineEdit* file_;
    QPlainTextEdit* commands_;
    QLabel* size_;
    QPushButton* export_;
};

/// The size of a picture, and for a turntable how many.
class PictureDialog : public QDialog {
    Q_OBJECT
  public:
    PictureDialog(bool turntable, const QSize& size, const QString& file, QWidget* parent);
    QSize size_of_picture() const { return {width_->value(), height_->value()}; }
    int frames() const { return frames_->value(); }
    QString file() const { return file_->text(); }

  private:
    QSpinBox *width_, *height_, *frames_;
    QLineEdit* file_;
};

}  // namespace marrow::viewer
