/// The panel beside the views: surfaces, their measures, the crop box and measurements.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include <QCheckBox>
#include <QComboBox>
#include <QFrame>
#include <QLabel>
#include <QLineEdit>
#include <QListWidget>
#include <QMenu>
#include <QSlider>
#include <QSpinBox>
#include <QToolButton>
#include <QVBoxLayout>
#include <QWidget>

#include "model/surfaces.h"

namespace marrow::viewer {

/// One surface in the list with its visibility, colour, name and isovalue. A click selects it; a double-click
/// edits its name.
class SurfaceRow : public QFrame {
    Q_OBJECT
  public:
    SurfaceRow(Session& session, int id, QWidget* parent = nullptr);
    int id() const { return id_; }
    void follow();
    /// Edits the name until the keyboard leaves its field.
    void rename();

  protected:
    void mousePressEvent(QMouseEvent* event) override;
    void mouseDoubleClickEvent(QMouseEvent* event) override;
    void changeEvent(QEvent* event) override;

  private:
    void choose_colour();
    void end_rename();

    Session& session_;
    const int id_;
    QToolButton* eye_;
    QToolButton* colour_;
    QLineEdit* name_;
    QLabel* isovalue_;
    QToolButton* remove_;
};

class SidePanel : public QWidget {
    Q_OBJECT
  public:
    /// Adds a button for the action that removes the crop box.
    SidePanel(Session& session, Surfaces& surfaces, QAction* whole_scan);
    void rename_current_surface();

  private:
    void add_surfaces(QVBoxLayout* layout);
    void add_opacity(QVBoxLayout* layout);
    void add_colouring(QVBoxLayout* layout);
    void add_options(QVBoxLayout* layout);
    void add_refinement(QVBoxLayout* layout);
    void show_measures(const MeshMeasures& measures, const QString& about);
    void show_validity(const Shape& shape, bool failed);
    void add_measures(QVBoxLayout* layout);
    void add_crop(QVBoxLayout* layout, QAction* whole_scan);
    void add_measurements(QVBoxLayout* layout);
    void fill_add_menu();
    void follow_parameters();
    void follow_rows();
    void follow_measurements();
    void follow_numbers();

    Session& session_;
    Surfaces& surfaces_;
    QVBoxLayout* rows_;
    std::vector<SurfaceRow*> row_list_;
    QMenu* add_menu_;
    QSlider* opacity_;
    QComboBox* colouring_;
    QCheckBox* largest_;
    QSpinBox *components_, *smooth_, *keep_;
    QCheckBox *open_, *topology_;
    QLabel* closedness_;
    std::array<QLabel*, 6> numbers_{};
    struct MeasuredSurface {
        int id;
        MeshMeasures measures;
    };
    std::optional<MeasuredSurface> measured_;  // the last one whose measures were shown
    QListWidget* measurements_;
    QLabel* no_measurements_;
};

}  // namespace marrow::viewer
