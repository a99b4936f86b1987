/// The windows that workstations offer for CT, and how a window is written.
#pragma once

#include <array>

#include <QString>

#include "model/session.h"

namespace marrow::viewer {

struct WindowPreset {
    const char* name;
    Window window;  ///< HU
};

inline constexpr std::array kWindowPresets{
    WindowPreset{"Bone", {300, 1500}}, WindowPreset{"Soft tissue", {40, 400}},
    WindowPreset{"Brain", {40, 80}}, WindowPreset{"Lung", {-600, 1500}}};

/// Width and level as on workstations: "W 1500 L 300".
QString window_text(const Window& window);

}  // namespace marrow::viewer
