// What the command line asks for.
#pragma once

#include <cstdint>
#include <filesystem>
#include <iosfwd>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <marrow/mesh_io.h>
#include <marrow/scan_io.h>
#include <marrow/volume.h>

#include <marrow/tissue_presets.h>
#include "steps.h"
#include "sweep.h"
#include "usage_error.h"

namespace marrow {

/// One surface to extract: at `isovalue`, at `preset`, or by Otsu's method where both are absent.
struct SurfaceRequest {
    std::string name;  ///< replaces {name} in the output; as given on the command line
    std::optional<double> isovalue;
    const Preset* preset = nullptr;
};

struct Settings {
    bool info = false;  ///< say what is in the inputs instead of extracting
    std::optional<SweepSettings>
        sweep;  ///< measure the surfaces of many isovalues instead; output is .csv or .json
    std::vector<std::filesystem::path> inputs;  ///< one, save for info
    std::filesystem::path output;               ///< file, folder or pattern with {name}; empty: no mesh
    std::filesystem::path picture;              ///< empty: none
    std::vector<SurfaceRequest> surfaces;
    bool labels = false;                ///< the input is a label map: a surface for each label
    std::filesystem::path label_table;  ///< names and colours; empty: none
    int relax = 40;                     ///< passes over the surfaces of labels
    std::string only;                   ///< the labels that are wanted, by number or name; empty: all
    std::string series;
    std::optional<Vec3d> spacing;  ///< mm
    bool resample = false;
    std::optional<std::int64_t> volume;
    Space space = Space::LPS;
    int threads = 0;
    std::optional<std::size_t> max_memory;  ///< bytes; read and write slab by slab within them
    bool open = false;
    double snap = 0;  ///< as IsosurfaceOptions::snap
    Steps steps;
    bool verify = false;  ///< read what was written and compare
    bool json = false;
    bool quiet = false;
    bool verbose = false;
    bool show_patient = false;  ///< with info
    bool check = false;         ///< check the meshes in inputs instead of extracting
    double min_wall = 0;        ///< mm, with check
    bool strict = false;        ///< with check
};

/// Understands the command line. Where it asks for help or the version, that goes to `out` and the result is
/// the exit code 0. \throw UsageError
std::variant<Settings, int> parse_command_line(int argc, const char* const* argv, std::ostream& out);

/// How the settings have their inputs read; without progress.
ScanOptions scan_options(const Settings& settings);

/// The file of each requested surface, in order, the same for all where it holds several; empty paths without an
/// output. \throw UsageError several surfaces for a file that holds one, two of the same name, or an unknown ending
std::vector<std::filesystem::path> output_files(const Settings& settings);

/// The files of surfaces of these names, in order; as output_files. \throw UsageError as there
std::vector<std::filesystem::path> files_for(const Settings& settings, const std::vector<std::string>& names);

}  // namespace marrow
