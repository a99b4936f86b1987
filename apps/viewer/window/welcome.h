/// The page that the window shows before a scan is opened.
#pragma once

#include <QAction>
#include <QScrollArea>

namespace marrow::viewer {

class Welcome : public QScrollArea {
    Q_OBJECT
  public:
    /// Adds a button for each of the two actions.
    Welcome(QAction* open_folder, QAction* open_file);
    void set_recent(const QStringList& paths);

  signals:
    void chosen(const QString& path);  ///< of a recent scan

  private:
    QWidget* recent_;
};

}  // namespace marrow::viewer
