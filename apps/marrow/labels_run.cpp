#include "labels_run.h"

#include <map>

#include <fmt/format.h>

#include <marrow/label_table.h>
#include <marrow/labels.h>
#include <marrow/scan_io.h>

#include "picture.h"
#include "report.h"

namespace marrow {
namespace fs = std::filesystem;
namespace {

// What a surface's file may be named by.
std::string file_name(const std::string& name) {
    std::string file;
    for (const char c : name) {
        const bool unwelcome = static_cast<unsigned char>(c) <= ' ' ||
                               std::string_view("/\\:*?\"<>|").find(c) != std::string_view::npos;
        file += unwelcome ? '_' : c;
    }
    return file.empty() || file.front() == '.' ? "_" + file : file;
}

}  // namespace

void extract_label_map(const Settings& settings, const Console& console, Voice& voice) {
    const Clock::time_point start = Clock::now();
    for (const fs::path& file : output_files(settings)) check_folder(file);
    check_folder(settings.picture);
    if (!settings.picture.empty()) require_display();
    const LabelTable table =
        settings.label_table.empty() ? LabelTable{} : read_label_table(settings.label_table);

    StageSeconds seconds;
    ScanInfo info;
    Volume map;
    seconds.read = voice.stage("read", [&](const Progress& progress) {
        ScanOptions options = scan_options(settings);
        options.progress = progress;
        map = read_scan(settings.inputs.front(), options, &info);
    });
    for (const std::string& warning : info.warnings) voice.warn(warning);

    std::vector<Surface> surfaces;
    seconds.extract = voice.stage("extract", [&](const Progress& progress) {
        for (LabelSurface& found : extract_labels(
                 map, {.relax = settings.relax, .threads = settings.threads, .progress = progress})) {
            Surface surface{fmt::format("label-{}", found.label), 0, std::move(found.mesh), {}};
            surface.colour = default_label_colour(found.label);
            if (const auto entry = table.find(found.label); entry != table.end()) {
                if (!entry->second.name.empty()) surface.name = entry->second.name;
                if (entry->second.colour) surface.colour = entry->second.colour;
            }
            surface.label = found.label;
            surfaces.push_back(std::move(surface));
        }
    });
    if (surfaces.empty())
        throw EmptySurface("the label map holds nothing but background, so there is no surface");

    std::map<std::string, int> uses;
    std::vector<std::string> names;
    for (const Surface& surface : surfaces) ++uses[file_name(surface.name)];
    for (const Surface& surface : surfaces) {
        const std::string name = file_name(surface.name);
        names.push_back(uses[name] > 1 ? fmt::format("{}-{}", name, *surface.label) : name);
    }
    const std::vector<fs::path> files = files_for(settings, names);
    for (std::size_t i = 0; i < surfaces.size(); ++i) surfaces[i].output = files[i];
    seconds.write = voice.stage(
        "write", [&](const Progress& progress) { write_surfaces(surfaces, settings.space, progress); });
    if (settings.verify)
        seconds.verify = voice.stage(
            "verify", [&](const Progress& progress) { verify_surfaces(surfaces, settings.space, progress); });
    if (!settings.picture.empty()) {
        seconds.write += voice.stage("picture", [&](const Progress& progress) {
            std::vector<PictureSurface> drawn;
            for (const Surface& surface : surfaces) drawn.push_back({&surface.mesh, *surface.colour, false});
            write_picture(drawn, settings.picture, progress);
        });
    }
    seconds.total = seconds_since(start);
    if (settings.json)
        print_json(console.out, info, surfaces, settings.space, info.warnings, seconds);
    else if (!settings.quiet)
        print_text(console.out, surfaces);
}

}  // namespace marrow
