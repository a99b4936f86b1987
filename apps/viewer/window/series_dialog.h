/// Asks what to open of an input with several series or volumes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include <QComboBox>
#include <QDialog>
#include <QLabel>
#include <QPushButton>
#include <QTableWidget>

#include <marrow/scan_io.h>

#include "model/previews.h"

namespace marrow::viewer {

/// Lists the series of an input, with pictures, and the volumes of the selected one. A series that cannot be
/// read shows the reason.
class SeriesDialog : public QDialog {
    Q_OBJECT
  public:
    SeriesDialog(const std::filesystem::path& input, const ScanOptions& options, ScanReport report,
                 QWidget* parent);
    /// The options to open what is chosen.
    ScanOptions chosen() const;

  private:
    void make_table();
    void fill_row(int row);
    void follow_selection();
    /// The index of the selected series; -1: none.
    int selected() const;

    const ScanOptions options_;
    const ScanReport report_;
    std::vector<std::int64_t> volumes_;  // chosen of each series
    Previews previews_;
    QTableWidget* table_;
    QLabel* volume_label_;
    QComboBox* volume_;
    QPushButton* open_;
};

}  // namespace marrow::viewer
