// The list of surfaces and what is known about them.
#pragma once

#include <QCheckBox>
#include <QFrame>
#include <QLabel>
#include <QLineEdit>
#include <QListWidget>
#include <QSlider>
#include <QToolButton>
#include <QVBoxLayout>
#include <QWidget>

#include "model/surfaces.h"

namespace marrow::viewer {

/// One surface in the list: visibility, colour, name, isovalue. A click selects it.
class SurfaceRow : public QFrame {
    Q_OBJECT
  public:
    SurfaceRow(Session& session, int id, QWidget* parent = nullptr);
    int id() const { return id_; }
    void follow();

  protected:
    void mousePressEvent(QMouseEvent* event) override;

  private:
    void choose_colour();

    Session& session_;
    const int id_;
    QToolButton* eye_;
    QToolButton* colour_;
    QLineEdit* name_;
    QLabel* isovalue_;
    QToolButton* remove_;
};

class Panel : public QWidget {
    Q_OBJECT
  public:
    /// With a button for the action that takes the crop box away.
    Panel(Session& session, Surfaces& surfaces, QAction* whole_scan);

  private:
    void follow_parameters();
    void follow_numbers();

    Session& session_;
    Surfaces& surfaces_;
    QVBoxLayout* rows_;
    std::vector<SurfaceRow*> row_list_;
    QToolButton* add_;
    QSlider* opacity_;
    QCheckBox* largest_;
    QCheckBox* open_;
    QLabel* light_;
    std::array<QLabel*, 6> numbers_{};
    QListWidget* measurements_;
    QLabel* no_measurements_;
};

}  // namespace marrow::viewer
