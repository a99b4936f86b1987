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
            {"volume_mm3", m.volume},
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

void extract_levels(const TerrainSettings& settings, const Console& console, Voice& voice) {
    constexpr std::array<double, 3> kGround{0.66, 0.62, 0.53};
    constexpr PictureView kFromAbove{20, 38};  // from the south
    const std::vector<fs::path> files = level_files(settings);
    if (!settings.output.has_filename() && !settings.output.empty()) fs::create_directories(settings.output);
    for (const fs::path& file : files) check_folder(file);
    check_folder(settings.picture);
    if (!settings.picture.empty()) require_display();
    const Clock::time_point start = Clock::now();
    // Levels that go into one file wait for the last.
    const bool in_one_file = files.size() > 1 && files[0] == files[1];
    std::vector<Mesh> waiting;
    Json json;
    double extract_seconds = 0, write_seconds = 0, cell = settings.cell;
    for (std::size_t level = 0; level < files.size(); ++level) {
        TerrainInfo info;
        Mesh mesh;
        extract_seconds += voice.stage("extract", [&](const Progress& progress) {
            mesh = extract_terrain(
                settings.input,
                {cell, settings.exaggerate, settings.base, settings.size, settings.threads, progress}, &info);
        });
        if (level == 0) {
            for (const std::string& warning : info.warnings) voice.warn(warning);
            if (files.size() > 1 && !info.georeferenced)
                throw UsageError("--levels needs a raster that says where its samples are");
            json["input"] = {{"format", info.format},
                             {"projection", info.projection.empty() ? Json() : Json(info.projection)},
                             {"centre_m", info.centre},
                             {"heights_m", {info.lowest, info.highest}}};
            json["exaggerate"] = settings.exaggerate;
            json["warnings"] = info.warnings;
        }
        write_seconds += voice.stage("write", [&](const Progress& progress) {
            if (!files[level].empty() && !in_one_file)
                write_mesh(mesh, files[level], {Space::none, progress});
        });
        if (level == 0 && !settings.picture.empty()) {
            write_seconds += voice.stage("picture", [&](const Progress& progress) {
                write_picture({{&mesh, kGround, false}}, settings.picture, progress, kFromAbove);
            });
        }
        if (settings.json)
            json["levels"].push_back(level_numbers(info, mesh, files[level]));
        else if (!settings.quiet)
            console.out << level_text(info, mesh, files[level]);
        cell = 2 * info.cell[2];
        if (in_one_file) waiting.push_back(std::move(mesh));
    }
    if (in_one_file) {
        std::vector<MeshObject> objects;
        for (const Mesh& mesh : waiting)
            objects.push_back({&mesh, fmt::format("level{}", objects.size()), kGround});
        write_seconds += voice.stage("write", [&](const Progress& progress) {
            write_meshes(objects, files.front(), {Space::none, progress});
        });
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
