// The command line's work, without the process around it.
#pragma once

#include <atomic>
#include <iosfwd>

#include "report.h"
#include "settings.h"

namespace marrow {

/// Where the results and the words about the work go.
struct Console {
    std::ostream& out;      ///< results
    std::ostream& err;      ///< errors, warnings, progress
    bool terminal = false;  ///< err is a terminal: draw a progress bar
};

/// Exit codes; see the footer of --help.
enum ExitCode {
    kOk = 0,
    kUsage = 2,
    kUnreadable = 3,
    kGeometry = 4,
    kEmpty = 5,
    kCheckFailed = 6,
    kCancelled = 130
};

/// Called before the work, so that a mistake does not cost it. \throw IoError where there is no folder for the
/// file; UsageError where it would take the place of what the scan `input` is read from. An empty path is no file.
void check_output(const std::filesystem::path& file, const std::filesystem::path& input);

/// Writes each file once, with all surfaces that go into it; none appears before all are complete. \throw as write_meshes
void write_surfaces(const std::vector<Surface>& surfaces, Space space, const Progress& progress);

/// Reads each file again and compares it with the surfaces in it. \throw as verify
void verify_surfaces(const std::vector<Surface>& surfaces, Space space, const Progress& progress);

/// Does what the settings ask for and returns the exit code; errors become one line on console.err.
/// Stops soon after `stop` becomes true; what was being written then leaves no trace.
int run(const Settings& settings, const Console& console, const std::atomic<bool>& stop);

}  // namespace marrow
