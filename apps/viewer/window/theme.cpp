#include "theme.h"

#include <QFont>
#include <QFontDatabase>
#include <QPalette>
#include <QStyleFactory>

namespace marrow::viewer {

void apply_theme(QApplication& application) {
    application.setStyle(QStyleFactory::create("Fusion"));
    QFont font = application.font();
    for (const char* family : {"Inter", "Noto Sans", "Ubuntu", "Cantarell"}) {
        if (!QFontDatabase().hasFamily(family)) continue;
        font.setFamily(family);
        break;
    }
    font.setPixelSize(13);
    application.setFont(font);

    QPalette palette;
    const QColor window(27, 30, 35), base(20, 22, 26), text(226, 230, 235), faint(132, 141, 151);
    palette.setColor(QPalette::Window, window);
    palette.setColor(QPalette::WindowText, text);
    palette.setColor(QPalette::Base, base);
    palette.setColor(QPalette::AlternateBase, window);
    palette.setColor(QPalette::Text, text);
    palette.setColor(QPalette::Button, QColor(43, 47, 54));
    palette.setColor(QPalette::ButtonText, text);
    palette.setColor(QPalette::ToolTipBase, QColor(50, 55, 63));
    palette.setColor(QPalette::ToolTipText, text);
    palette.setColor(QPalette::PlaceholderText, faint);
    palette.setColor(QPalette::Highlight, QColor(52, 111, 184));
    palette.setColor(QPalette::HighlightedText, Qt::white);
    palette.setColor(QPalette::Link, QColor(107, 172, 245));
    for (const auto role : {QPalette::WindowText, QPalette::Text, QPalette::ButtonText})
        palette.setColor(QPalette::Disabled, role, QColor(92, 99, 108));
    application.setPalette(palette);

    application.setStyleSheet(R"(
QMainWindow, QDialog { background: #1b1e23; }
QToolTip { background: #323740; color: #e2e6eb; border: 1px solid #454b55; padding: 5px; }
QMenuBar { background: #15171b; color: #c5cbd3; padding: 2px 6px; }
QMenuBar::item { padding: 4px 10px; border-radius: 5px; background: transparent; }
QMenuBar::item:selected { background: #2c3138; }
QMenu { background: #24282e; border: 1px solid #3a4049; padding: 5px; }
QMenu::item { padding: 6px 28px 6px 26px; border-radius: 5px; }
QMenu::item:selected { background: #346fb8; color: white; }
QMenu::item:disabled { color: #5c636c; }
QMenu::separator { height: 1px; background: #3a4049; margin: 5px 8px; }
QMenu::indicator { width: 13px; height: 13px; left: 7px; }
QToolBar { background: #1b1e23; border: none; border-bottom: 1px solid #0f1114; spacing: 3px; padding: 5px 10px; }
QToolBar::separator { background: #343a43; width: 1px; margin: 5px 7px; }
QToolButton { color: #cfd5dc; border: 1px solid transparent; border-radius: 6px; padding: 4px 8px; background: transparent; }
QToolButton:hover { background: #2c3138; }
QToolButton:pressed { background: #23272d; }
QToolButton:checked { background: #2f4a6b; color: white; border-color: #3f6596; }
QToolButton:disabled { color: #5c636c; }
QToolButton:focus { border-color: #4a7ab5; }
QToolButton::menu-indicator { image: none; }
QToolButton#side { padding: 4px 6px; min-width: 12px; }
QToolButton#eye, QToolButton#colour, QToolButton#remove { padding: 2px; }
QToolButton#remove { color: #8b949e; font-size: 16px; }
QToolButton#add_surface { color: #6bacf5; padding: 2px 8px; }
QPushButton { background: #2f343c; color: #e2e6eb; border: 1px solid #3c434d; border-radius: 6px; padding: 6px 14px; }
QPushButton:hover { background: #373d46; }
QPushButton:pressed { background: #292e35; }
QPushButton:focus { border-color: #4a7ab5; }
QPushButton:disabled { color: #5c636c; background: #24282e; }
QPushButton:default, QToolButton#export { background: #2f6db5; color: white; border: 1px solid #3b7cc7; }
QPushButton:default:hover, QToolButton#export:hover { background: #3a7ac4; }
QPushButton:default:disabled, QToolButton#export:disabled { background: #262c34; color: #5c636c; border-color: #30363f; }
QToolButton#export { padding: 4px 14px; font-weight: 600; }
QPushButton#chip { border-radius: 12px; padding: 3px 12px; background: #23272d; border-color: #353b44; color: #cfd5dc; }
QPushButton#chip:hover { background: #2f353d; }
QPushButton#chip:checked { background: #4a3a1c; border-color: #b98a35; color: #ffd9a0; }
QPushButton#chip:disabled { color: #50565e; }
QLineEdit, QDoubleSpinBox, QSpinBox, QPlainTextEdit { background: #141619; border: 1px solid #343a43; border-radius: 6px;
  padding: 4px 7px; selection-background-color: #346fb8; }
QLineEdit:focus, QDoubleSpinBox:focus, QSpinBox:focus { border-color: #4a7ab5; }
QLineEdit#surface_name { background: transparent; border: 1px solid transparent; padding: 2px 3px; }
QLineEdit#surface_name:focus { background: #141619; border-color: #4a7ab5; }
QLabel[role="heading"] { color: #f0f3f6; font-weight: 600; }
QLabel[role="faint"] { color: #8b949e; }
QLabel[role="title"] { font-size: 30px; font-weight: 600; color: #f0f3f6; }
QFrame#surface_row { background: #22262c; border: 1px solid #22262c; border-radius: 7px; }
QFrame#surface_row[current="true"] { border-color: #4a7ab5; background: #262d37; }
QWidget#panel, QWidget#bottom { background: #1b1e23; }
QWidget#welcome { background: #14161a; }
QFrame#banner { background: #5a2a22; border-radius: 7px; }
QFrame#banner QLabel { color: #ffdcd3; }
QFrame#banner[kind="note"] { background: #2c3a26; }
QFrame#banner[kind="note"] QLabel { color: #dcebd3; }
QListWidget { background: #16181c; border: 1px solid #2b3037; border-radius: 6px; padding: 3px; }
QListWidget::item { padding: 3px 5px; border-radius: 4px; }
QListWidget::item:selected { background: #2f4a6b; color: white; }
QTableWidget { background: #16181c; border: 1px solid #2b3037; border-radius: 6px; gridline-color: #262b31; }
QHeaderView::section { background: #22262c; color: #aab2bc; border: none; padding: 6px; }
QSlider::groove:horizontal { height: 4px; background: #343a43; border-radius: 2px; }
QSlider::sub-page:horizontal { background: #4a7ab5; border-radius: 2px; }
QSlider::handle:horizontal { width: 14px; height: 14px; margin: -5px 0; border-radius: 7px; background: #d5dbe2; }
QSlider::handle:horizontal:focus { background: white; }
QCheckBox { spacing: 7px; }
QCheckBox::indicator { width: 13px; height: 13px; border: 1px solid #4d5560; border-radius: 4px; background: #141619; }
QCheckBox::indicator:hover, QCheckBox::indicator:focus { border-color: #6bacf5; }
QCheckBox::indicator:checked { background: #3f83d6; border-color: #6bacf5; }
QSplitter::handle { background: #0f1114; }
QSplitter::handle:hover { background: #346fb8; }
QStatusBar { background: #15171b; color: #8b949e; }
QStatusBar::item { border: none; }
QProgressBar { background: #141619; border: 1px solid #343a43; border-radius: 5px; height: 10px; text-align: center; }
QProgressBar::chunk { background: #3f83d6; border-radius: 4px; }
QLineEdit#command, QPlainTextEdit#commands { font-family: "JetBrains Mono", "DejaVu Sans Mono", monospace; font-size: 12px; color: #b7d7a8; background: #101214;
  border-color: #24282e; }
QScrollArea { border: none; background: transparent; }
QScrollBar:vertical { background: #1b1e23; width: 8px; margin: 0; }
QScrollBar::handle:vertical { background: #3a4049; border-radius: 4px; min-height: 30px; }
QScrollBar::add-line:vertical, QScrollBar::sub-line:vertical { height: 0; }
QScrollBar::add-page:vertical, QScrollBar::sub-page:vertical { background: transparent; }
QSpinBox[section="crop"] { padding: 1px 5px; }
)");
}

}  // namespace marrow::viewer
