#include <ostream>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <marrow/measure.h>
#include <marrow/mesh_io.h>
#include <marrow/terrain.h>

#include "picture.h"
#include "terrain.h"
#include "voice.h"

namespace marrow {
namespace fs = std::filesystem;
namespace {

using Json = nlohmann::ordered_json;

constexpr std::array<double, 3> kGround{0.66, 0.62, 0.53};

struct Level {
    TerrainInfo info;
    Mesh mesh;
};

Json level_numbers(const TerrainInfo& info, const Mesh& mesh, const fs::path& output) {
    const MeshMeasures m = measure(mesh);
    return {{"samples", info.samples},
            {"cell_m", info.cell},
            {"mm_per_metre", info.mm_per_metre},
            {"unknown_samples", info.unknown_samples},
            {"points", m.points},
            {"triangles", m.triangles},
            {"components", m.components},
            {"boundary_edges", m.boundary_edges},
            {"nonmanifold_edges", m.nonmanifold_edges},
            {"euler_characteristic", m.euler_characteristic},
            {"area_mm2", m.area},
            {"volume_mm3", m.boundary_edges == 0 ? Json(m.volume) : Json()},
            {"bounds_mm", {m.lower, m.upper}},
            {"height_error",
             {{"rms_m", info.rms_error},
              {"max_m", info.max_error},
              {"rms_of_cell", info.rms_error / info.cell[2]}}},
            {"output", output.empty() ? Json() : Json(output.string())}};
}

std::string level_text(const TerrainInfo& info, const Mesh& mesh, const fs::path& output) {
    return fmt::format(
        "{}: {} points, {} triangles; {} x {} samples, {:.4g} m apart; heights off by {:.3g} m RMS ({:.2g} "
        "of a sample)\n",
        output.empty() ? "terrain" : output.string(), mesh.points.size(), mesh.triangles.size(),
        info.samples[0], info.samples[1], info.cell[2], info.rms_error, info.rms_error / info.cell[2]);
}

void check_levels(const TerrainSettings& settings) {
    const std::optional<int> most = most_terrain_levels(settings.input, settings.cell > 0 ? std::optional(settings.cell) : std::nullopt);
    if (!most) throw UsageError("--levels needs a raster that says where its samples are");
    if (settings.levels > *most)
        throw UsageError(
            fmt::format("--levels {}: level{} would have less than 2 x 2 samples; at most {} can be",
                        settings.levels, *most, *most));
}

// Each into its file, or all as nodes of one.
void write_levels(const std::vector<Level>& levels, const std::vector<fs::path>& files,
                  const Progress& progress) {
    if (files.front().empty()) return;
    const bool in_one_file = files.size() > 1 && files[0] == files[1];
    std::vector<MeshObject> objects;
    for (const Level& level : levels)
        objects.push_back({&level.mesh, fmt::format("level{}", objects.size()), kGround});
    MeshFiles all;
    if (in_one_file) all.write(objects, files.front(), {Space::none, progress});
    for (std::size_t i = 0; i < files.size() && !in_one_file; ++i)
        all.write(std::array{MeshObject{&levels[i].mesh}}, files[i], {Space::none, progress});
    all.commit();
}

void extract_levels(const TerrainSettings& settings, const Console& console, Voice& voice) {
    constexpr PictureView kFromAbove{20, 38};  // from the south
    const std::vector<fs::path> files = level_files(settings);
    if (!settings.output.has_filename() && !settings.output.empty()) fs::create_directories(settings.output);
    for (const fs::path& file : files) check_output(file, settings.input);
    check_output(settings.picture, settings.input);
    if (!settings.picture.empty()) require_display();
    const Clock::time_point start = Clock::now();
    if (files.size() > 1) check_levels(settings);
    std::vector<Level> levels(files.size());  // all are there before the first is written
    double extract_seconds = 0, write_seconds = 0, cell = settings.cell;
    for (Level& level : levels) {
        extract_seconds += voice.stage("extract", [&](const Progress& progress) {
            level.mesh = extract_terrain(
                settings.input,
                {cell > 0 ? std::optional(cell) : std::nullopt, settings.exaggerate, settings.base, settings.size, settings.threads, progress},
                &level.info);
        });
        if (&level == &levels.front()) {
            for (const std::string& warning : level.info.warnings) voice.warn(warning);
        }
        if (level.mesh.triangles.empty())
            throw EmptySurface(fmt::format(
                "no surface{}: of {} x {} samples, {} have no height, and no four side by side have one",
                files.size() > 1 ? fmt::format(" at level{}", &level - levels.data()) : "",
                level.info.samples[0], level.info.samples[1], level.info.unknown_samples));
        cell = 2 * level.info.cell[2];
    }
    write_seconds +=
        voice.stage("write", [&](const Progress& progress) { write_levels(levels, files, progress); });
    if (!settings.picture.empty()) {
        write_seconds += voice.stage("picture", [&](const Progress& progress) {
            write_picture({{&levels.front().mesh, kGround, false}}, settings.picture, progress, kFromAbove);
        });
    }
    const TerrainInfo& info = levels.front().info;
    Json json{{"input",
               {{"format", info.format},
                {"projection", info.projection.empty() ? Json() : Json(info.projection)},
                {"centre_m", info.centre},
                {"heights_m", {info.lowest, info.highest}}}},
              {"exaggerate", settings.exaggerate},
              {"warnings", info.warnings}};
    for (std::size_t i = 0; i < files.size(); ++i) {
        if (settings.json)
            json["levels"].push_back(level_numbers(levels[i].info, levels[i].mesh, files[i]));
        else if (!settings.quiet)
            console.out << level_text(levels[i].info, levels[i].mesh, files[i]);
    }
    json["seconds"] = {
        {"extract", extract_seconds}, {"write", write_seconds}, {"total", seconds_since(start)}};
    if (settings.json) console.out << json.dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
}

}  // namespace

int run_terrain(const TerrainSettings& settings, const Console& console, const std::atomic<bool>& stop) {
    return exit_code_of(console, [&] {
        Voice voice(settings.quiet, settings.verbose, console, stop);
        extract_levels(settings, console, voice);
        return kOk;
    });
}

}  // namespace marrow
