// Watches the field that has the keyboard.
#include "field_keys.h"

#include <QAbstractSpinBox>
#include <QApplication>
#include <QKeyEvent>
#include <QLineEdit>
#include <QVariant>

namespace marrow::viewer {
namespace {

// The value of a spin box, or the text of a line.
QVariant content(const QObject* field) {
    return field->property(qobject_cast<const QAbstractSpinBox*>(field) ? "value" : "text");
}

void set_content(QObject* field, const QVariant& value) {
    field->setProperty(qobject_cast<QAbstractSpinBox*>(field) ? "value" : "text", value);
}

constexpr const char* kBefore = "content_before";

}  // namespace

FieldKeys::FieldKeys(QWidget* window, QWidget* next) : QObject(window), next_(next) {
    connect(qApp, &QApplication::focusChanged, this, [this, window](QWidget* old, QWidget* now) {
        if (old) old->removeEventFilter(this);
        const bool field = qobject_cast<QAbstractSpinBox*>(now) || qobject_cast<QLineEdit*>(now);
        if (!field || now->window() != window) return;
        now->setProperty(kBefore, content(now));
        now->installEventFilter(this);
    });
}

bool FieldKeys::eventFilter(QObject* field, QEvent* event) {
    if (event->type() != QEvent::KeyPress && event->type() != QEvent::ShortcutOverride) return false;
    const int key = static_cast<QKeyEvent*>(event)->key();
    const bool accept = key == Qt::Key_Return || key == Qt::Key_Enter, restore = key == Qt::Key_Escape;
    if (!accept && !restore) return false;
    event->accept();  // so that Esc is no shortcut here
    if (event->type() == QEvent::ShortcutOverride) return true;
    if (restore) set_content(field, field->property(kBefore));
    next_->setFocus();  // a field takes over its text when it loses the keyboard
    return true;
}

}  // namespace marrow::viewer
