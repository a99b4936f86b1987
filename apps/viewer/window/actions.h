// What a person can ask for: keys, menus, tool bar.
#pragma once

#include <array>
#include <map>

#include <QAction>
#include <QActionGroup>
#include <QMainWindow>
#include <QMenu>

#include "model/session.h"

namespace marrow::viewer {

/// The actions that look from a side, in the order of Side.
inline constexpr std::array kSideActions{"anterior", "posterior", "left", "right", "superior", "inferior"};

/// All actions of the window, by name. Those that change nothing but the session do so; the window connects the others.
class Actions : public QObject {
    Q_OBJECT
  public:
    Actions(QMainWindow* window, Session& session);

    /// \pre there is one of that name
    QAction* operator[](const char* name) const { return actions_.at(name); }
    /// Filled by the window.
    QMenu* recent() { return recent_; }

  private:
    QAction* add(const QString& name, const QString& text, const QKeySequence& shortcut, const QString& tip);
    void make_file_and_edit();
    void make_choices();
    void make_views();
    void make_windows();
    void connect_to_session();
    void make_menus();
    void make_tool_bar();
    void follow();

    QMainWindow* window_;
    Session& session_;
    std::map<QString, QAction*> actions_;
    QActionGroup *modes_, *tools_, *cuts_;
    QMenu* recent_;
};

}  // namespace marrow::viewer
