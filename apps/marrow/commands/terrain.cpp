// Extracts terrain from an elevation raster.
#include "terrain.h"

#include <array>
#include <ostream>

#include <fmt/format.h>

#include <marrow/measure.h>
#include <marrow/mesh_io.h>
#include <marrow/printable.h>
#include <marrow/terrain.h>

#include "json_report.h"
#include "outputs.h"
#include "progress_reporter.h"
#include "render.h"
#include "report.h"
#include "shared/display.h"
#include "shared/output_checks.h"

namespace marrow::apps {
namespace fs = std::filesystem;
namespace {

constexpr std::array<double, 3> kGround{0.66, 0.62, 0.53};
constexpr double kPrintSize = 150;  // mm: fits the beds of common 3D printers
constexpr int kMostLevels = 16;

bool is_positive(double x) {
    return x > 0 && x < 1e12;
}

std::vector<fs::path> level_files(const TerrainCommandOptions& options) {
    std::vector<std::string> names;
    for (int level = 0; level < options.levels; ++level)
        names.push_back(options.levels > 1 ? fmt::format("level{}", level) : options.input.stem().string());
    const std::vector<fs::path> files = files_for(options.output, names);
    if (is_dicom_output(options.output))
        throw UsageError("a .dcm file is about a patient: give another format");
    // A scene keeps the levels apart; in other formats they would overlap.
    if (is_shared_file(files) && mesh_format(files.front()) != MeshFormat::glb)
        throw UsageError(fmt::format(
            "the file '{}' can hold only one level: give a .glb file, a folder, or a pattern such "
            "as '{{name}}.stl'",
            files.front().string()));
    return files;
}

// A base without a size makes a model to print.
TerrainOptions terrain_options(const TerrainCommandOptions& options) {
    TerrainOptions result;
    if (options.cell) result.cell = *options.cell;
    result.exaggerate = options.exaggerate;
    result.base = options.base;
    result.size = options.size;
    if (options.base && !options.size) result.size = kPrintSize;
    result.threads = options.threads;
    return result;
}

void check(const TerrainCommandOptions& options) {
    require_output(options.output, options.picture);
    const std::optional<double> size = terrain_options(options).size;
    if (options.base && *options.base > kMostTerrainBase * *size)
        throw UsageError(fmt::format("--base takes at most {:g} times the model's length of {:g} mm",
                                     kMostTerrainBase, *size));
    level_files(options);  // so that mistakes in the output are found before the work
}

void check_levels(const TerrainCommandOptions& options) {
    const std::optional<int> most = most_terrain_levels(options.input, terrain_options(options).cell);
    if (!most) throw UsageError("--levels needs a raster that states its coordinates");
    if (options.levels > *most)
        throw UsageError(
            fmt::format("--levels {}: level{} would have less than 2 x 2 samples; at most {} are possible",
                        options.levels, *most, *most));
}

std::string level_text(const TerrainLevel& level) {
    const TerrainInfo& info = level.info;
    return fmt::format(
        "{}: {} points, {} triangles; {} x {} samples, {:.4g} m apart; heights off by {:.3g} m RMS ({:.2g} "
        "of a sample)\n",
        printable(level.output.empty() ? "terrain" : level.output.string()), level.mesh.points.size(),
        level.mesh.triangles.size(), info.samples[0], info.samples[1], info.cell[2], info.rms_error,
        info.rms_error / info.cell[2]);
}

// Extracts all levels before the first is written, each with twice the cell of the one before. They lie on
// each other.
void extract_levels(const TerrainCommandOptions& options, const ProgressReporter& reporter,
                    TerrainResults& results) {
    TerrainOptions terrain = terrain_options(options);
    const std::size_t count = results.levels.size();
    for (std::size_t i = 0; i < count; ++i) {
        TerrainLevel& level = results.levels[i];
        results.extract_seconds += reporter.stage("extract", [&](const Progress& progress) {
            terrain.progress = progress;
            level.mesh = extract_terrain(options.input, terrain, &level.info);
        });
        if (i == 0) {
            for (const std::string& warning : level.info.warnings) reporter.warn(warning);
        }
        if (level.mesh.triangles.empty())
            throw EmptySurface(fmt::format(
                "no surface{}: {} of {} x {} samples have no height, and no four neighbours all have one",
                count > 1 ? fmt::format(" at level{}", i) : "", level.info.unknown_samples,
                level.info.samples[0], level.info.samples[1]));
        terrain.cell = 2 * level.info.cell[2];
        terrain.first_level = &results.levels.front().info;
    }
}

// Writes each level to its file, or all as nodes of one scene.
void write_levels(const std::vector<TerrainLevel>& levels, bool in_one_file, const Progress& progress) {
    if (levels.front().output.empty()) return;
    MeshFiles files;
    if (in_one_file) {
        std::vector<MeshObject> objects;
        for (const TerrainLevel& level : levels)
            objects.push_back({level.mesh, fmt::format("level{}", objects.size()), kGround});
        files.write(objects, levels.front().output, {Space::none, progress});
    } else {
        for (const TerrainLevel& level : levels)
            files.write(std::array{MeshObject{level.mesh}}, level.output, {Space::none, progress});
    }
    files.commit();
}

void draw(const TerrainCommandOptions& options, const Mesh& mesh, const Progress& progress) {
    constexpr CameraAngles kFromAbove{20, 38};  // from the south
    render({{&mesh, kGround, false}}, options.picture, progress, kFromAbove);
}

}  // namespace

void add_options(Arguments& arguments, TerrainCommandOptions& options) {
    const char* positive = "a positive number";
    arguments.add_input("DEM", options.input,
                        "GeoTIFF, USGS DEM, SRTM .hgt, DTED, Arc/Info ASCII or ERDAS grid, PNG heights");
    arguments.start_group("Surface");
    arguments.add_option("--base", number_value("MM", positive, options.base, is_positive),
                         fmt::format("Make a closed block that reaches MM below the lowest ground. Without "
                                     "--size it is {:g} mm long.",
                                     kPrintSize));
    arguments.add_option("--size", number_value("MM", positive, options.size, is_positive),
                         "Set the length of the model's longer side.");
    arguments.add_option("--exaggerate", number_value("Z", positive, options.exaggerate, is_positive),
                         "Multiply heights by Z.");
    arguments.add_option("--cell", number_value("M", positive, options.cell, is_positive),
                         "Set the distance between samples in metres; default: that of the raster.");
    arguments.add_option("--levels", integer_value("N", options.levels, 1, kMostLevels),
                         "Write N levels of detail, each with half the resolution of the one before.");
    arguments.start_group("Output");
    add_mesh_option(arguments, options.output, ".stl, .ply, .obj (also .gz), .vtp, .3mf or .glb");
    add_picture_option(arguments, options.picture);
    add_general_options(arguments, options.threads, options.reporting);
}

void run(const TerrainCommandOptions& options, const Console& console, const std::atomic<bool>& stop) {
    if (options.input.empty())
        throw UsageError("no raster is given: name a file (see marrow terrain --help)");
    check(options);
    const ProgressReporter reporter(options.reporting, console, stop);
    const std::vector<fs::path> files = level_files(options);
    for (const fs::path& file : files) check_output(file, options.input);
    check_output(options.picture, options.input);
    if (!options.picture.empty()) require_display("--picture");

    const Clock::time_point start = Clock::now();
    if (files.size() > 1) check_levels(options);
    TerrainResults results;
    results.exaggerate = options.exaggerate;
    for (const fs::path& file : files) results.levels.push_back({{}, {}, file, {}});
    extract_levels(options, reporter, results);
    results.write_seconds += reporter.stage("write", [&](const Progress& progress) {
        write_levels(results.levels, is_shared_file(files), progress);
    });
    if (!options.picture.empty())
        results.write_seconds += reporter.stage("picture", [&](const Progress& progress) {
            draw(options, results.levels.front().mesh, progress);
        });
    results.total_seconds = seconds_since(start);

    if (options.reporting.json) {
        for (TerrainLevel& level : results.levels)
            level.measures = measure(level.mesh, {.threads = options.threads});
        console.out << terrain_json(results);
    } else if (!options.reporting.quiet) {
        for (const TerrainLevel& level : results.levels) console.out << level_text(level);
    }
}

int run_terrain(int argc, const char* const* argv, const Console& console, const std::atomic<bool>& stop) {
    constexpr const char* kFooter =
        "The model is in mm: x to the east, y to the north, z up. Without --size and --base it has its true\n"
        "size.\n"
        "With several levels, OUT is a folder; a pattern with {name}, which becomes level0, level1, ...; or "
        "a\n"
        ".glb file, in which they are nodes of these names.\n"
        "Exit codes: see marrow --help.";
    const auto read_and_run = [&] {
        TerrainCommandOptions options;
        Arguments arguments("marrow terrain",
                            {"Turns an elevation raster into a surface, or into a block to print.",
                             "marrow terrain DEM -o OUT [OPTIONS]", kFooter});
        add_options(arguments, options);
        if (arguments.parse(argc, argv, console.out)) run(options, console, stop);
        return kOk;
    };
    return exit_code_of(console, read_and_run, error_printer(argc, argv, console.out));
}

}  // namespace marrow::apps
