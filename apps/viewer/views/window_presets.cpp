// Writes windows as text.
#include "window_presets.h"

#include <cmath>

namespace marrow::viewer {
namespace {

// Whole numbers, as on workstations, unless the window is narrow.
QString number(double value, double width) {
    return width >= 20 ? QString::number(std::round(value), 'f', 0) : QString::number(value, 'g', 4);
}

}  // namespace

QString window_text(const Window& window) {
    return QString("W %1 L %2").arg(number(window.width, window.width), number(window.centre, window.width));
}

}  // namespace marrow::viewer
