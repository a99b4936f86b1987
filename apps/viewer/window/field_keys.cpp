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

bool is_field(const QWidget* widget) {
    return qobject_cast<const QAbstractSpinBox*>(widget) || qobject_cast<const QLineEdit*>(widget);
}

constexpr const char* kBefore = "content_before";

}  // namespace

FieldKeys::FieldKeys(QWidget* window) : QObject(window), window_(window) {
    connect(qApp, &QApplication::focusChanged, this, [this](QWidget* old, QWidget* now) {
        if (old) old->removeEventFilter(this);
        if (!is_field(now) || now->window() != window_) return;
        now->setProperty(kBefore, content(now));
        now->installEventFilter(this);
    });
}

void FieldKeys::accept() {
    if (QWidget* field = window_->focusWidget(); is_field(field)) leave(field);
}

void FieldKeys::leave(QWidget* field) {
    field->clearFocus();  // it takes over its text
    emit left();
}

bool FieldKeys::eventFilter(QObject* field, QEvent* event) {
    if (event->type() != QEvent::KeyPress && event->type() != QEvent::ShortcutOverride) return false;
    const int key = static_cast<QKeyEvent*>(event)->key();
    const bool accept = key == Qt::Key_Return || key == Qt::Key_Enter, restore = key == Qt::Key_Escape;
    if (!accept && !restore) return false;
    event->accept();  // so that Esc is no shortcut here
    if (event->type() == QEvent::ShortcutOverride) return true;
    if (restore) set_content(field, field->property(kBefore));
    leave(static_cast<QWidget*>(field));
    return true;
}

}  // namespace marrow::viewer
