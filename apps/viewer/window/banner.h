// A sentence over the window, such as why a file cannot be read.
#pragma once

#include <QFrame>
#include <QLabel>
#include <QMainWindow>
#include <QTimer>

namespace marrow::viewer {

/// Errors stay until they are closed, notes go by themselves.
class Banner : public QFrame {
    Q_OBJECT
  public:
    explicit Banner(QMainWindow* window);

    void say(const QString& sentence, bool error);
    /// What it says; empty while it is hidden.
    QString sentence() const { return isHidden() ? QString() : text_->text(); }
    /// Puts it where it belongs in the window, whose size has changed.
    void place();

  private:
    QMainWindow* window_;
    QLabel* text_;
    QTimer timer_;
};

}  // namespace marrow::viewer
