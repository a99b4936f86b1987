/// Measures how long a user waits for the viewer (marrow-viewer --measure).
#pragma once

#include <filesystem>

#include "main_window.h"

namespace marrow::viewer {

/// Opens the scan in the window, moves the isovalue as a user would, exports to a temporary file, and prints
/// the times to stdout. Returns the exit code of the process.
int measure_viewer(MainWindow& window, const std::filesystem::path& input, const ScanOptions& options);

}  // namespace marrow::viewer
