/// Prints what is known of extracted surfaces.
#pragma once

#include <iosfwd>

#include "progress_reporter.h"
#include "results.h"

namespace marrow::cli {

/// Prints one line a surface, and one below it for each step that changed it.
void print_text(std::ostream& out, const std::vector<Surface>& surfaces);

/// Prints JSON or text to the console, as the options want it.
void print_results(const ProgressReporter& reporter, const SurfaceResults& results, Space space);

}  // namespace marrow::cli
