/// The appearance of the window.
#pragma once

#include <QApplication>

namespace marrow::viewer {

/// Applies a dark theme, so that the surfaces are the brightest part of the window, or a light one.
void apply_theme(QApplication& application, bool light = false);

}  // namespace marrow::viewer
