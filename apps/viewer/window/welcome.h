// What the window shows before a scan is opened.
#pragma once

#include <QAction>
#include <QWidget>

namespace marrow::viewer {

class Welcome : public QWidget {
    Q_OBJECT
  public:
    /// With a button for each of the two.
    Welcome(QAction* open_folder, QAction* open_file);
    void set_recent(const QStringList& paths);

  signals:
    void chosen(const QString& path);  ///< a recent one

  private:
    QWidget* recent_;
};

}  // namespace marrow::viewer
