// Keeps the wheel from fields that do not have the keyboard.
#include "panel_wheel.h"

#include <QAbstractSlider>
#include <QAbstractSpinBox>
#include <QComboBox>
#include <QEvent>

namespace marrow::viewer {

PanelWheel::PanelWheel(QWidget* panel) : QObject(panel) {
    for (QWidget* widget : panel->findChildren<QWidget*>()) {
        if (!qobject_cast<QAbstractSpinBox*>(widget) && !qobject_cast<QAbstractSlider*>(widget) &&
            !qobject_cast<QComboBox*>(widget))
            continue;
        widget->setFocusPolicy(Qt::StrongFocus);  // the wheel does not give it the keyboard
        widget->installEventFilter(this);
    }
}

bool PanelWheel::eventFilter(QObject* field, QEvent* event) {
    if (event->type() != QEvent::Wheel || static_cast<QWidget*>(field)->hasFocus()) return false;
    event->ignore();  // so that it goes to the panel
    return true;
}

}  // namespace marrow::viewer
