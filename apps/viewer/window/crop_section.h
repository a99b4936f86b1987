/// The fields for the crop box in the side panel.
#pragma once

#include <array>

#include <QLabel>
#include <QSpinBox>
#include <QWidget>

#include "model/session.h"

namespace marrow::viewer {

/// Shows and edits the first and the last sample of the crop box along each index axis.
class CropSection : public QWidget {
    Q_OBJECT
  public:
    explicit CropSection(Session& session);

  private:
    void follow_scan();
    void follow_parameters();

    Session& session_;
    std::array<QLabel*, 3> names_{};
    std::array<std::array<QSpinBox*, 2>, 3> numbers_{};
    QLabel* size_;
};

}  // namespace marrow::viewer
