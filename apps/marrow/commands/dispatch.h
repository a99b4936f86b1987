/// The program `marrow`, without the process around it.
#pragma once

#include <atomic>

#include "shared/console.h"

namespace marrow::apps {

/// Reads the command line, runs the command that it names and returns its exit code. Errors become one line
/// on console.err. Stops soon after `stop` becomes true; unfinished files then leave no trace.
int run_marrow(int argc, const char* const* argv, const Console& console, const std::atomic<bool>& stop);

}  // namespace marrow::apps
