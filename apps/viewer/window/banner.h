/// A message above the views, such as why a file cannot be read.
#pragma once

#include <QFrame>
#include <QLabel>
#include <QMainWindow>
#include <QTimer>

namespace marrow::viewer {

/// Errors stay until they are closed. Notes disappear after a few seconds.
class Banner : public QFrame {
    Q_OBJECT
  public:
    explicit Banner(QMainWindow* window);

    void show_message(const QString& message, bool error);
    /// The message; empty while the banner is hidden.
    QString message() const { return isHidden() ? QString() : text_->text(); }
    /// Adapts to the size of the window.
    void reposition();

  private:
    QMainWindow* window_;
    QLabel* text_;
    QTimer timer_;
};

}  // namespace marrow::viewer
