/// Asks what to open of an input with several series or volumes.
#pragma once

#include <cstdint>
#include <vector>

#include <QComboBox>
#include <QDialog>
#include <QLabel>
#include <QPushButton>
#include <QTableWidget>

#include "model/loader.h"
#include "model/previews.h"

namespace marrow::viewer {

/// Lists the series of an input, with pictures, and the volumes of the selected one. A series that cannot be
/// read, or not without another decision, shows the reason.
class SeriesDialog : public QDialog {
    Q_OBJECT
  public:
    SeriesDialog(const OpenQuestion& question, QWidget* parent);
    /// The options to open what is chosen.
    ScanOptions chosen() const;

  private:
    void make_table();
    void fill_row(int row);
    void follow_selection();
    /// The index of the selected series; -1: none.
    int selected() const;

    const OpenQuestion question_;
    std::vector<std::int64_t> volumes_;  // chosen of each series
    Previews previews_;
    QTableWidget* table_;
    QLabel* volume_label_;
    QComboBox* volume_;
    QPushButton* open_;
};

}  // namespace marrow::viewer
