/// Leaving a field of the window, by keys or before an action.
#pragma once

#include <QWidget>

namespace marrow::viewer {

/// Enter accepts what was typed into a field of a window, and Esc restores the value before. Both take the
/// keyboard from the field, so that the next key is a shortcut again and not more text.
class FieldKeys : public QObject {
    Q_OBJECT
  public:
    explicit FieldKeys(QWidget* window);
    /// Does what Enter does, if a field has the keyboard.
    void accept();

  signals:
    void left();  ///< no widget has the keyboard

  protected:
    bool eventFilter(QObject* field, QEvent* event) override;

  private:
    void leave(QWidget* field);

    QWidget* window_;
};

}  // namespace marrow::viewer
