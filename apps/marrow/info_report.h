/// Prints what is in a scan.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "results.h"

namespace marrow::apps {

/// Prints the details of a single series. Of several, prints a line for each, and the details of the one that
/// would be read.
void print_finding(std::ostream& out, const Finding& finding, bool show_patient);

/// What the headers of a series do not state, and nobody can know from them.
std::vector<std::string> unknown_facts(const SeriesReport& series);

}  // namespace marrow::apps
