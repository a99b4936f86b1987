/// The keys that leave a field of the window.
#pragma once

#include <QWidget>

namespace marrow::viewer {

/// Enter accepts what was typed into a field of a window, and Esc restores the value before. Both give the
/// keyboard to another widget, so that the next key is a shortcut again and not more text.
class FieldKeys : public QObject {
    Q_OBJECT
  public:
    FieldKeys(QWidget* window, QWidget* next);

  protected:
    bool eventFilter(QObject* field, QEvent* event) override;

  private:
    QWidget* next_;
};

}  // namespace marrow::viewer
