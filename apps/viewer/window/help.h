// What the help menu shows.
#pragma once

#include <QWidget>

namespace marrow::viewer {

void show_about(QWidget* parent);
void show_keys(QWidget* parent);

}  // namespace marrow::viewer
