// The command `marrow terrain`.
#pragma once

#include <atomic>
#include <filesystem>
#include <iosfwd>
#include <optional>
#include <variant>
#include <vector>

#include "run.h"

namespace marrow {

struct TerrainSettings {
    std::filesystem::path input;
    std::filesystem::path output;   ///< file; folder, pattern with {name} or .glb for several levels
    std::filesystem::path picture;  ///< of the first level; empty: none
    double cell = 0;                ///< metres; 0: the raster's own
    double exaggerate = 1;
    std::optional<double> base;  ///< mm
    std::optional<double> size;  ///< mm
    int levels = 1;
    int threads = 0;
    bool json = false;
    bool quiet = false;
    bool verbose = false;
};

/// Understands the command line after `marrow terrain`. Where it asks for help, that goes to `out` and the result
/// is the exit code 0. \throw UsageError
std::variant<TerrainSettings, int> parse_terrain_command(int argc, const char* const* argv,
                                                         std::ostream& out);

/// The file of each level; the same for all where they go into one .glb. \throw UsageError an unknown ending, or several levels for one file
std::vector<std::filesystem::path> level_files(const TerrainSettings& settings);

/// As run() for scans.
int run_terrain(const TerrainSettings& settings, const Console& console, const std::atomic<bool>& stop);

}  // namespace marrow
