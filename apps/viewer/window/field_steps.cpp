// Ends the steps of undo before a field handles an event.
#include "field_steps.h"

#include <QKeyEvent>

namespace marrow::viewer {

FieldSteps::FieldSteps(QWidget* field, Session& session) : QObject(field), session_(session) {
    field->installEventFilter(this);
}

bool FieldSteps::eventFilter(QObject*, QEvent* event) {
    switch (event->type()) {
        case QEvent::KeyPress:
        case QEvent::KeyRelease:
            if (!static_cast<QKeyEvent*>(event)->isAutoRepeat()) session_.end_step();
            break;
        case QEvent::MouseButtonPress:
        case QEvent::MouseButtonRelease:
        case QEvent::FocusIn:   // after another field has taken over its text
        case QEvent::FocusOut:  // before this one does
            session_.end_step();
            break;
        default:
            break;
    }
    return false;
}

}  // namespace marrow::viewer
