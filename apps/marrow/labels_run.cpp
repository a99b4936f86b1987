#include "labels_run.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include <marrow/label_table.h>
#include <marrow/labels.h>
#include <marrow/measure.h>
#include <marrow/scan_io.h>
#include <marrow/vector.h>

#include "picture.h"
#include "report.h"
#include "warnings.h"

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

using Counts = std::map<std::int64_t, std::int64_t>;

// A label of the map, as the table has it or made up.
struct Label {
    std::string name, file_name;
    std::array<double, 3> colour;
    bool wanted = true;
};
using Labels = std::map<std::int64_t, Label>;

Labels labels_of(const Counts& counts, const LabelTable& table) {
    Labels labels;
    std::map<std::string, int> uses;
    for (const auto& [label, samples] : counts) {
        if (label == LabelOptions{}.background) continue;
        Label one{fmt::format("label-{}", label), {}, default_label_colour(label)};
        if (const auto entry = table.find(label); entry != table.end()) {
            if (!entry->second.name.empty()) one.name = entry->second.name;
            if (entry->second.colour) one.colour = *entry->second.colour;
        }
        one.file_name = file_name(one.name);
        ++uses[one.file_name];
        labels.emplace(label, std::move(one));
    }
    for (auto& [label, one] : labels) {
        if (uses[one.file_name] > 1) one.file_name += fmt::format("-{}", label);
    }
    return labels;
}

// By number or name, with commas between; a name may have commas itself.
void choose(const std::string& only, Labels& labels) {
    if (only.empty()) return;
    for (auto& [label, one] : labels) one.wanted = false;
    const auto choose_one = [&](const std::string& wanted) {
        bool found = false;
        for (auto& [label, one] : labels) {
            if (wanted != std::to_string(label) && wanted != one.name) continue;
            one.wanted = found = true;
        }
        return found;
    };
    if (choose_one(only)) return;
    for (std::size_t begin = 0; begin <= only.size();) {
        const std::size_t end = std::min(only.find(',', begin), only.size());
        const std::string wanted = only.substr(begin, end - begin);
        if (!choose_one(wanted))
            throw UsageError(
                fmt::format("--only: there is no label '{}' in what is read of the map", wanted));
        begin = end + 1;
    }
}

void name_files(const Settings& settings, const Labels& labels, std::vector<Surface>& surfaces) {
    std::vector<std::string> names;
    for (const Surface& surface : surfaces) names.push_back(labels.at(*surface.label).file_name);
    const std::vector<fs::path> files = files_for(settings, names);
    for (std::size_t i = 0; i < surfaces.size(); ++i) {
        check_output(files[i], settings.inputs.front());
        surfaces[i].output = files[i];
    }
}

// Before the work, as there may be thousands of surfaces to come.
void warn_of_scan(const Counts& counts, std::vector<std::string>& warnings) {
    constexpr std::size_t kMany = 256;
    if (counts.size() > kMany && counts.begin()->first < 0)
        warnings.push_back(
            fmt::format("there are {} labels, from {} to {}: is this a scan rather than a label map?",
                        counts.size(), counts.begin()->first, counts.rbegin()->first));
}

void warn_of_table(const Settings& settings, const LabelTable& table, const Labels& labels,
                   std::vector<std::string>& warnings) {
    const bool any = std::any_of(labels.begin(), labels.end(),
                                 [&](const auto& entry) { return table.contains(entry.first); });
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
                        "few samples thick shrink",
                        many, surfaces.size(), most->name, most->label_volume.change()));
}

}  // namespace

void extract_label_map(const Settings& settings, const Console& console, Voice& voice) {
    const Clock::time_point start = Clock::now();
    for (const fs::path& file : output_files(settings)) check_output(file, settings.inputs.front());
    check_output(settings.picture, settings.inputs.front());
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
    const Counts counts = count_labels(map, {.threads = settings.threads});
    Labels labels = labels_of(counts, table);
    if (labels.empty()) throw EmptySurface("there is nothing but background, so there is no surface");
    choose(settings.only, labels);
    warn_of_scan(counts, warnings);
    warn_of_table(settings, table, labels, warnings);
    for (const std::string& warning : warnings) voice.warn(warning);
    const std::size_t warned = warnings.size();

    std::vector<Surface> surfaces;
    seconds.extract = voice.stage("extract", [&](const Progress& progress) {
        // Those that are not wanted too, so that their neighbours have the same shape.
        for (LabelSurface& found : extract_labels(
                 map, {.relax = settings.relax, .threads = settings.threads, .progress = progress})) {
            const Label& label = labels.at(found.label);
            if (!label.wanted) continue;
            Surface& surface = surfaces.emplace_back(Surface{label.name, 0, std::move(found.mesh), {}});
            surface.colour = label.colour;
            surface.label = found.label;
        }
    });
    const Mat3d step = map.geometry().index_to_physical();
    const double sample_mm3 = std::abs(dot(step[0], cross(step[1], step[2])));
    for (Surface& surface : surfaces) {
        const std::int64_t samples = counts.at(*surface.label);
        surface.label_volume = {samples, static_cast<double>(samples) * sample_mm3,
                                measure(surface.mesh).volume};
    }
    warn_of_loss(surfaces, warnings);
    name_files(settings, labels, surfaces);
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
