#include <ostream>
#include <string>

#include <fmt/format.h>
#include <marrow/version.h>
#include <marrow/terrain.h>
#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

#include "terrain.h"

namespace marrow {
namespace fs = std::filesystem;
namespace {

constexpr double kPrintSize = 150;  // mm: fits the beds of common 3D printers
constexpr int kMostLevels = 16;

}  // namespace

std::variant<TerrainSettings, int> parse_terrain_command(int argc, const char* const* argv,
                                                         std::ostream& out) {
    TerrainSettings settings;
    CLI::App app("Turns an elevation raster into a surface, or a block to print.", "marrow terrain");
    app.set_version_flag("--version", "marrow " MARROW_VERSION);
    app.footer(fmt::format(
        "The model is in mm: x to the east, y to the north, z up. Without --size and --base it has true "
        "size.\n"
        "Several levels: OUT is a folder or a pattern with {{name}}, which becomes level0, level1, ...,\n"
        "or a .glb file, in which they are nodes of these names.\n"
        "Exit codes: as of marrow."));
    app.add_option("DEM", settings.input,
                   "GeoTIFF, USGS DEM, SRTM .hgt, DTED, Arc/Info or ERDAS grid, PNG heights")
        ->required();
    app.add_option("-o,--output", settings.output,
                   "mesh to write: .stl, .ply, .obj (also .gz), .vtp, .3mf or .glb")
        ->type_name("OUT");
    app.add_option(
           "--base", settings.base,
           fmt::format(
               "a closed block, with MM below the lowest ground; {:g} mm long unless --size says otherwise",
               kPrintSize))
        ->type_name("MM");
    app.add_option("--size", settings.size, "length of the model's longer side")->type_name("MM");
    app.add_option("--exaggerate", settings.exaggerate, "multiply heights by Z")->type_name("Z");
    app.add_option("--cell", settings.cell, "metres between samples; default: as in the raster")
        ->type_name("M");
    app.add_option("--levels", settings.levels, "write N levels of detail, each at half the resolution")
        ->type_name("N");
    app.add_option("--picture", settings.picture, "picture of the terrain to write")->type_name("FILE.png");
    app.add_option("--threads", settings.threads, "threads to use; 0: all (default)")->type_name("N");
    app.add_flag("--json", settings.json, "print the results as one JSON object");
    app.add_flag("-q,--quiet", settings.quiet, "print errors only (and JSON, if asked for)");
    app.add_flag("-v,--verbose", settings.verbose, "say how long each stage took");
    try {
        app.parse(argc, argv);
    } catch (const CLI::CallForHelp&) {
        out << app.help();
        return 0;
    } catch (const CLI::CallForVersion& version) {
        out << version.what() << '\n';
        return 0;
    } catch (const CLI::ParseError& error) {
        throw UsageError(fmt::format("{} (see marrow terrain --help)", error.what()));
    }
    if (settings.output.empty() && settings.picture.empty())
        throw UsageError(
            "where to? give -o OUT.stl (or .ply, .obj, .vtp, .3mf, .glb), --picture FILE.png, or both");
    const auto check_positive = [](const char* option, double value) {
        if (!(value > 0 && value < 1e12)) throw UsageError(fmt::format("{} takes a positive number", option));
    };
    check_positive("--exaggerate", settings.exaggerate);
    if (app.count("--cell") > 0) check_positive("--cell", settings.cell);
    if (settings.size) check_positive("--size", *settings.size);
    if (settings.base) {
        check_positive("--base", *settings.base);
        if (!settings.size) settings.size = kPrintSize;
        if (*settings.base > kMostTerrainBase * *settings.size)
            throw UsageError(fmt::format("--base takes at most {:g} times the model's length of {:g} mm",
                                         kMostTerrainBase, *settings.size));
    }
    if (settings.levels < 1 || settings.levels > kMostLevels)
        throw UsageError(fmt::format("--levels takes a number from 1 to {}", kMostLevels));
    if (settings.threads < 0) throw UsageError("--threads takes a number from 0 (all) upwards");
    if (!settings.picture.empty() && settings.picture.extension() != ".png")
        throw UsageError(fmt::format("--picture writes .png, not '{}'", settings.picture.string()));
    level_files(settings);  // so that a mistake shows before the work
    return settings;
}

std::vector<fs::path> level_files(const TerrainSettings& settings) {
    constexpr std::string_view kName = "{name}";
    std::vector<fs::path> files(static_cast<std::size_t>(settings.levels));
    if (settings.output.empty()) return files;
    std::string pattern = settings.output.string();
    if (!settings.output.has_filename() || fs::is_directory(settings.output))
        pattern = (settings.output / "{name}.stl").string();
    const std::size_t at = pattern.find(kName);
    // Scenes keep levels apart; elsewhere they would lie in each other.
    if (at == pattern.npos && files.size() > 1 && fs::path(pattern).extension() != ".glb")
        throw UsageError(
            fmt::format("{} levels do not fit in one file '{}': give a .glb file, a folder or a pattern "
                        "such as '{{name}}.stl'",
                        files.size(), pattern));
    for (std::size_t level = 0; level < files.size(); ++level) {
        std::string file = pattern;
        if (at != pattern.npos) file.replace(at, kName.size(), fmt::format("level{}", level));
        files[level] = file;
        try {
            mesh_format(files[level]);
        } catch (const InputError& error) {
            throw UsageError(error.what());
        }
    }
    return files;
}

}  // namespace marrow
