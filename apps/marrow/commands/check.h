/// The command `marrow check`: says whether meshes are fit to print.
#pragma once

#include <atomic>
#include <filesystem>
#include <vector>

#include "options.h"
#include "shared/console.h"

namespace marrow::apps {

struct CheckCommandOptions {
    std::vector<std::filesystem::path> inputs;
    double min_wall = 0;  ///< mm; 0: do not look for thin walls
    bool strict = false;
    int threads = 0;
    Reporting reporting;
};

void add_options(Arguments& arguments, CheckCommandOptions& options);

/// Checks all meshes and prints what was found; a mesh that cannot be read does not stop the others. Returns
/// kUnreadable if one cannot be read, and with options.strict kCheckFailed if one
/// is not sound or has thin walls.
ExitCode run(const CheckCommandOptions& options, const Console& console, const std::atomic<bool>& stop);

}  // namespace marrow::apps
