/// The screen that pictures and windows need.
#pragma once

#include <string_view>

namespace marrow::apps {

/// Connects to the X display, which OpenGL needs for drawing. `who` begins the message: "--picture"; `remedy`
/// ends it. \throw IoError there is no display, or it lacks OpenGL
void require_display(std::string_view who, std::string_view remedy = "run 'xvfb-run -a marrow ...'");

}  // namespace marrow::apps
