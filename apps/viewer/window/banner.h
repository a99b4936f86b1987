/// A message over the views, such as why a file cannot be read.
#pragma once

#include <QFrame>
#include <QLabel>
#include <QTimer>

namespace marrow::viewer {

/// How serious a message is. Errors stay until they are closed; the others disappear after a while.
enum class Severity { note, information, error };

class Banner : public QFrame {
    Q_OBJECT
  public:
    /// Appears at the top of `area`, which is in `window`.
    Banner(QWidget* window, QWidget* area);

    void show_message(const QString& message, Severity severity);
    /// Hides what is about the scan or the attempt before. A note, such as that a file is saved, stays.
    void hide_unless_note();
    /// The message; empty while the banner is hidden.
    QString message() const { return isHidden() ? QString() : text_->text(); }
    /// Adapts to the size of the window.
    void reposition();

  private:
    QWidget *window_, *area_;
    QLabel* text_;
    Severity severity_ = Severity::note;
    QTimer timer_;
};

}  // namespace marrow::viewer
