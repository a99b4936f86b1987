/// Prints what is known of extracted surfaces.
#pragma once

#include <functional>
#include <iosfwd>
#include <string>
#include <vector>

#include "progress_reporter.h"
#include "results.h"

namespace marrow::apps {

/// Prints one line a surface, one below it if relaxation held points back, one for each step that changed it,
/// and whether the files were verified.
void print_text(std::ostream& out, const SurfaceResults& results);

/// Prints JSON or text to the console, as the options want it.
void print_results(const ProgressReporter& reporter, const SurfaceResults& results, Space space);

/// What exit_code_of() is to do with an error: with --json among the arguments, print it as JSON to `out`.
/// Mistakes in the command line count too, so that `out` always receives one object.
std::function<void(const std::string& message, ExitCode)> error_printer(int argc, const char* const* argv,
                                                                        std::ostream& out);

}  // namespace marrow::apps
