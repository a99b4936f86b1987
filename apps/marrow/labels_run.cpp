#include "labels_run.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include <marrow/label_table.h>
#include <marrow/labels.h>
#include <marrow/measure.h>
#include <marrow/scan_io.h>
#include <marrow/vector.h>

#include "meeting_points.h"
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

// Names and colours from the table; of labels that it does not have, made up.
Surface named(LabelSurface& found, const LabelTable& table) {
    Surface surface{fmt::format("label-{}", found.label), 0, std::move(found.mesh), {}};
    surface.colour = default_label_colour(found.label);
    if (const auto entry = table.find(found.label); entry != table.end()) {
        if (!entry->second.name.empty()) surface.name = entry->second.name;
        if (entry->second.colour) surface.colour = entry->second.colour;
    }
    surface.label = found.label;
    return surface;
}

// Drops what was not asked for; its neighbours keep their shape.
void keep_wanted(const Settings& settings, std::vector<Surface>& surfaces) {
    if (settings.only.empty()) return;
    const auto is = [](const Surface& surface, const std::string& wanted) {
        return wanted == std::to_string(*surface.label) || wanted == surface.name;
    };
    for (const std::string& wanted : settings.only) {
        if (std::none_of(surfaces.begin(), surfaces.end(), [&](const Surface& s) { return is(s, wanted); }))
            throw UsageError(fmt::format("--only: the map has no label '{}'", wanted));
    }
    std::erase_if(surfaces, [&](const Surface& surface) {
        return std::none_of(settings.only.begin(), settings.only.end(),
                            [&](const std::string& wanted) { return is(surface, wanted); });
    });
}

void name_files(const Settings& settings, std::vector<Surface>& surfaces) {
    std::map<std::string, int> uses;
    std::vector<std::string> names;
    for (const Surface& surface : surfaces) ++uses[file_name(surface.name)];
    for (const Surface& surface : surfaces) {
        const std::string name = file_name(surface.name);
        names.push_back(uses[name] > 1 ? fmt::format("{}-{}", name, *surface.label) : name);
    }
    const std::vector<fs::path> files = files_for(settings, names);
    for (std::size_t i = 0; i < surfaces.size(); ++i) surfaces[i].output = files[i];
}

// Before the work, as there may be thousands of surfaces to come.
void warn_of_scan(const std::map<std::int64_t, std::int64_t>& counts, std::vector<std::string>& warnings) {
    constexpr std::size_t kMany = 256;
    if (counts.size() > kMany && counts.begin()->first < 0)
        warnings.push_back(
            fmt::format("there are {} labels, from {} to {}: is this a scan rather than a label map?",
                        counts.size(), counts.begin()->first, counts.rbegin()->first));
}

void warn_of_table(const Settings& settings, const LabelTable& table, const std::vector<Surface>& surfaces,
                   std::vector<std::string>& warnings) {
    const bool any = std::any_of(surfaces.begin(), surfaces.end(),
                                 [&](const Surface& surface) { return table.contains(*surface.label); });
    if (!settings.label_table.empty() && !any)
        warnings.push_back(fmt::format("'{}' has none of the map's labels", settings.label_table.string()));
}

// Thin parts lose much to relaxation.
void warn_of_loss(const std::vector<Surface>& surfaces, std::vector<std::string>& warnings) {
    constexpr double kMuch = -10;  // %
    std::size_t many = 0;
    const Surface* most = nullptr;
    for (const Surface& surface : surfaces) {
        if (surface.label_volume.change() > kMuch) continue;
        ++many;
        if (!most || surface.label_volume.change() < most->label_volume.change()) most = &surface;
    }
    if (most)
        warnings.push_back(
            fmt::format("{} of {} surfaces enclose at least a tenth less than their samples, {} most: "
                        "{:+.0f} %; parts that are "
                        "few samples thick shrink, with --relax 0 least",
                        many, surfaces.size(), most->name, most->label_volume.change()));
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
    if (settings.steps.change_volume())
        seconds.filter = voice.stage("filter", [&](const Progress& progress) {
            filter_scan(map, settings.steps, settings.threads, progress);
        });
    std::vector<std::string> warnings = info.warnings;
    const auto counts = count_labels(map);
    warn_of_scan(counts, warnings);
    for (const std::string& warning : warnings) voice.warn(warning);
    const std::size_t warned = warnings.size();

    std::vector<Surface> surfaces;
    seconds.extract = voice.stage("extract", [&](const Progress& progress) {
        for (LabelSurface& found : extract_labels(
                 map, {.relax = settings.relax, .threads = settings.threads, .progress = progress}))
            surfaces.push_back(named(found, table));
    });
    if (surfaces.empty())
        throw EmptySurface("the label map holds nothing but background, so there is no surface");
    keep_wanted(settings, surfaces);
    const Mat3d step = map.geometry().index_to_physical();
    const double sample_mm3 = std::abs(dot(step[0], cross(step[1], step[2])));
    for (Surface& surface : surfaces) {
        const std::int64_t samples = counts.at(*surface.label);
        surface.label_volume = {samples, static_cast<double>(samples) * sample_mm3,
                                measure(surface.mesh).volume};
    }
    warn_of_table(settings, table, surfaces, warnings);
    warn_of_loss(surfaces, warnings);
    name_files(settings, surfaces);
    warn_of_meeting_points(surfaces, "where that matters write .3mf or .ply", warnings);
    for (std::size_t i = warned; i < warnings.size(); ++i) voice.warn(warnings[i]);

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
        print_json(console.out, info, surfaces, settings.space, warnings, seconds);
    else if (!settings.quiet)
        print_text(console.out, surfaces);
}

}  // namespace marrow
