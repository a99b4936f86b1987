/// The bar below the views: isovalue, presets, histogram and command line.
#pragma once

#include <vector>

#include <QAction>
#include <QBoxLayout>
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
    /// The command line that writes the same file as Export.
    QString command() const { return command_->text(); }

  private:
    QLayout* make_isovalue_row();
    QLayout* make_command_row(QAction* copy);
    QPushButton* add_chip(QBoxLayout* row, const QString& name, const QString& tip);
    void use_otsu();
    void follow_scan();
    void follow_parameters();

    Session& session_;
    HistogramBar* histogram_;
    QDoubleSpinBox* isovalue_;
    std::vector<QPushButton*> chips_;  // the presets, then Otsu
    QLineEdit* command_;
};

}  // namespace marrow::viewer
