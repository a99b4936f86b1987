/// Measurements as a table for spreadsheets.
#pragma once

#include <filesystem>
#include <vector>

#include "session.h"

namespace marrow::viewer {

/// Writes one line for each measurement as CSV: its number, kind, value and unit, and the coordinates of its
/// positions, LPS mm. \throw IoError
void write_measurements(const std::vector<Measurement>& measurements, const std::filesystem::path& file);

}  // namespace marrow::viewer
