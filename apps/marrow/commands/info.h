/// The command `marrow info`: says what is in scans and which series would be read.
#pragma once

#include <atomic>
#include <filesystem>
#include <vector>

#include "options.h"
#include "shared/console.h"

namespace marrow::apps {

struct InfoCommandOptions {
    std::vector<std::filesystem::path> inputs;
    ScanOptions scan{.keep_stored = true};  ///< as for extraction, to see what they change
    bool headers = false;                   ///< do not read the samples
    std::filesystem::path picture;          ///< of the middle slice; empty: none
    bool show_patient = false;
    Reporting reporting;
};

void add_options(Arguments& arguments, InfoCommandOptions& options);

/// Inspects all inputs and prints what was found; an input that cannot be described does not stop the others.
/// Returns the exit code of the first one that cannot. A scan that would be refused is described,
/// too, but cannot have a picture.
ExitCode run(const InfoCommandOptions& options, const Console& console, const std::atomic<bool>& stop);

}  // namespace marrow::apps
