/// The command `marrow sweep`: shows how the surface depends on the isovalue.
#pragma once

#include <atomic>
#include <filesystem>
#include <optional>

#include "options.h"
#include "shared/console.h"
#include "steps.h"

namespace marrow::apps {

struct SweepCommandOptions {
    ScanInput scan;
    FilterSteps filters;
    std::optional<double> from, to;  ///< none: the least and the largest sample
    int samples = 100;
    bool topology = false;        ///< as SweepOptions::topology
    std::filesystem::path table;  ///< .csv or .json; empty: print it
    std::filesystem::path plot;   ///< .svg; empty: none
    Reporting reporting;
};

void add_options(Arguments& arguments, SweepCommandOptions& options);

/// The last lines of the help.
extern const char* const kSweepHelp;

/// Measures, writes and prints. \throw UsageError; EmptySurface there is no surface at any isovalue
void run(const SweepCommandOptions& options, const Console& console, const std::atomic<bool>& stop);

}  // namespace marrow::apps
