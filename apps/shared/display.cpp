// Connects to the X display.
#include "display.h"

#include <chrono>
#include <cstdlib>
#include <thread>

#include <X11/Xlib.h>
#include <fmt/format.h>

#include <marrow/error.h>

namespace marrow::apps {

// Without a display, or its OpenGL, VTK and Qt would end the process. An X server resets itself when its last
// client leaves, and refuses new clients meanwhile. So try for a second, and stay connected until they are.
void require_display(std::string_view who, std::string_view remedy) {
    static Display* display = nullptr;
    for (int attempt = 0; display == nullptr && attempt < 10; ++attempt) {
        if (attempt > 0) std::this_thread::sleep_for(std::chrono::milliseconds(100));
        display = XOpenDisplay(nullptr);
        if (std::getenv("DISPLAY") == nullptr) break;
    }
    if (display == nullptr)
        throw IoError(fmt::format("{} needs a display, but there is none: {}", who, remedy));
    int opcode = 0, event = 0, error = 0;
    if (XQueryExtension(display, "GLX", &opcode, &event, &error) == False)
        throw IoError(fmt::format("{} needs a display with OpenGL, and '{}' lacks its extension GLX: {}", who,
                                  DisplayString(display), remedy));
}

}  // namespace marrow::apps
