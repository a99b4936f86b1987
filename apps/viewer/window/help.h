/// The messages of the help menu.
#pragma once

#include <QWidget>

namespace marrow::viewer {

void show_about(QWidget* parent);
void show_keys(QWidget* parent);

}  // namespace marrow::viewer
