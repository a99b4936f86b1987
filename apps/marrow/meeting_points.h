// Points of a surface that lie in the same place.
#pragma once

#include <string>
#include <vector>

#include "report.h"

namespace marrow {

/// Warns of surfaces in STL files some of whose points lie where others do. STL has only coordinates, so whoever reads it
/// joins them, and edges may then have more than two triangles.
void warn_of_meeting_points(const std::vector<Surface>& surfaces, const std::string& remedy,
                            std::vector<std::string>& warnings);

}  // namespace marrow
