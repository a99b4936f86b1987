/// The command `marrow terrain`: turns elevation rasters into surfaces. It is a program of its own, so that
/// only it loads GDAL.
#pragma once

#include <atomic>
#include <filesystem>
#include <optional>

#include "options.h"
#include "shared/console.h"

namespace marrow::apps {

struct TerrainCommandOptions {
    std::filesystem::path input;
    std::filesystem::path output;   ///< file; for several levels a folder, a pattern with {name} or .glb
    std::filesystem::path picture;  ///< of the first level; empty: none
    std::optional<double> cell;     ///< metres; none: that of the raster
    double exaggerate = 1;
    std::optional<double> base;  ///< mm
    std::optional<double> size;  ///< mm
    int levels = 1;
    int threads = 0;
    Reporting reporting;
};

void add_options(Arguments& arguments, TerrainCommandOptions& options);

/// Extracts, writes, draws and reports all levels. \throw UsageError; EmptySurface; as extract_terrain
void run(const TerrainCommandOptions& options, const Console& console, const std::atomic<bool>& stop);

/// Reads the command line after `marrow`, runs the command and returns its exit code. Errors become one line
/// on console.err.
int run_terrain(int argc, const char* const* argv, const Console& console, const std::atomic<bool>& stop);

}  // namespace marrow::apps
