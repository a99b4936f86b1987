// How the window looks.
#pragma once

#include <QApplication>

namespace marrow::viewer {

/// Dark, so that the picture is the brightest thing on the screen.
void apply_theme(QApplication& application);

}  // namespace marrow::viewer
