/// What the wheel of the mouse does over a panel.
#pragma once

#include <QWidget>

namespace marrow::viewer {

/// Lets the wheel scroll a panel also where the pointer is over a field, unless the field has the keyboard.
/// Otherwise, scrolling would change the fields that pass below the pointer.
class PanelWheel : public QObject {
    Q_OBJECT
  public:
    /// \pre the panel has all of its fields
    explicit PanelWheel(QWidget* panel);

  protected:
    bool eventFilter(QObject* field, QEvent* event) override;
};

}  // namespace marrow::viewer
