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

/// The axis of the patient that an index axis runs closest to: 0 left, 1 posterior, 2 superior.
std::size_t main_direction(const Mat3d& direction, std::size_t axis);

/// How the slices lie in the patient: "axial", "oblique, nearly sagittal".
std::string plane_name(const Mat3d& direction);

}  // namespace marrow::apps
