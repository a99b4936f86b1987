/// Prints what is in a scan.
#pragma once

#include <iosfwd>

#include "results.h"

namespace marrow::apps {

/// Prints the details of a single series. Of several, prints a line for each, and the details of the one that
/// would be read.
void print_finding(std::ostream& out, const Finding& finding, bool show_patient);

}  // namespace marrow::apps
