/// The actions of the window with their keys, menus and tool bar.
#pragma once

#include <array>
#include <map>

#include <QAction>
#include <QActionGroup>
#include <QMainWindow>
#include <QMenu>

#include "model/session.h"

namespace marrow::viewer {

/// The actions that view from a side, in the order of Side.
inline constexpr std::array kSideActions{"anterior", "posterior", "left", "right", "superior", "inferior"};

/// All actions of the window by name. Actions that only change the session are connected here; the window
/// connects the others.
class Actions : public QObject {
    Q_OBJECT
  public:
    Actions(QMainWindow* window, Session& session);

    /// \pre the action exists
    QAction* operator[](const char* name) const { return actions_.at(name); }
    /// The menu of recent scans, which the window fills.
    QMenu* recent() { return recent_; }
    QMenu* view_menu() { return view_menu_; }
    /// The row of tools below the menus, which the window places.
    QWidget* tool_bar() { return tool_bar_; }

  signals:
    void triggered();  ///< before the action does anything

  private:
    QAction* add(const QString& name, const QString& text, const QKeySequence& shortcut, const QString& tip);
    void make_file_and_edit();
    void make_modes_and_tools();
    void make_cuts();
    void add_choice(QActionGroup* group, const QString& name, const QString& text, const QKeySequence& key,
                    const QString& tip, int value);
    void make_views();
    void make_windows();
    void connect_to_session();
    void make_menus();
    void make_tool_bar();
    QAction* open_menu_action();
    QAction* cut_menu_action();
    void follow();

    QMainWindow* window_;
    Session& session_;
    std::map<QString, QAction*> actions_;
    QActionGroup *modes_, *tools_, *cuts_;
    QMenu *recent_, *view_menu_;
    QWidget* tool_bar_;
};

}  // namespace marrow::viewer
