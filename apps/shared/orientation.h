/// How the index axes of a scan lie in the patient, from the direction matrix of its geometry.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include <marrow/volume.h>

namespace marrow::apps {

/// The axis of the patient that an index axis runs closest to: 0 left, 1 posterior, 2 superior.
std::size_t main_direction(const Mat3d& direction, std::size_t axis);

/// The direction of the patient that an index axis runs closest to: "left", "inferior".
std::string_view direction_name(const Mat3d& direction, std::size_t axis);

/// How the slices lie in the patient: "axial", "oblique, nearly sagittal".
std::string plane_name(const Mat3d& direction);

}  // namespace marrow::apps
