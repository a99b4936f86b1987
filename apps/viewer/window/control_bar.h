// The strip below the views: isovalue, presets, histogram, command line.
#pragma once

#include <QAction>
#include <QDoubleSpinBox>
#include <QLineEdit>
#include <QPushButton>
#include <QWidget>

#include "views/histogram_bar.h"

namespace marrow::viewer {

class ControlBar : public QWidget {
    Q_OBJECT
  public:
    ControlBar(Session& session, QAction* copy);

    HistogramBar* histogram() { return histogram_; }
    /// The command line that writes what Export does.
    QString command() const { return command_->text(); }

  private:
    void follow_scan();
    void follow_parameters();

    Session& session_;
    HistogramBar* histogram_;
    QDoubleSpinBox* isovalue_;
    std::vector<QPushButton*> chips_;  ///< the presets, then Otsu
    QLineEdit* command_;
};

}  // namespace marrow::viewer
