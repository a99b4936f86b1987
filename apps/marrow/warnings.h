// What extraction warns of: surfaces that are likely not what was wanted.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <marrow/volume.h>

#include "report.h"

namespace marrow {

/// Samples without a value.
void warn_of_non_finite(std::int64_t samples, std::vector<std::string>& warnings);

/// Surfaces in STL files some of whose points lie where others do. STL has only coordinates, so whoever reads it joins them,
/// and edges may then have more than two triangles.
void warn_of_meeting_points(const std::vector<Surface>& surfaces, const std::string& remedy,
                            std::vector<std::string>& warnings);

/// The same of isosurfaces through samples.
void warn_of_ties(const std::vector<Surface>& surfaces, const Volume& scan,
                  std::vector<std::string>& warnings);

/// Closed surfaces of a scan that is inside as a whole.
void warn_of_box(const std::vector<Surface>& surfaces, const Volume& scan,
                 std::vector<std::string>& warnings);

}  // namespace marrow
