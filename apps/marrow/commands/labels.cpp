// Extracts a surface for each label of a map.
#include "labels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include <fmt/format.h>

#include <marrow/label_table.h>
#include <marrow/labels.h>
#include <marrow/measure.h>
#include <marrow/scan_io.h>
#include <marrow/vector.h>

#include "outputs.h"
#include "shared/label_map.h"
#include "shared/output_checks.h"
#include "shared/report_progress.h"
#include "shared/suggestions.h"
#include "warnings.h"

namespace marrow::apps {
namespace fs = std::filesystem;
namespace {

// The part of a file's name that stands for a label: characters that file systems or shells do not like
// become "_".
std::string file_name(const std::string& name) {
    std::string file;
    for (const char c : name) {
        const bool unsuitable = static_cast<unsigned char>(c) <= ' ' ||
                                std::string_view("/\\:*?\"<>|").find(c) != std::string_view::npos;
        file += unsuitable ? '_' : c;
    }
    return file.empty() || file.front() == '.' ? "_" + file : file;
}

using Counts = std::map<std::int64_t, std::int64_t>;

// A label map with the names and colours of its segments.
struct LabelMap {
    Volume samples;
    LabelTable segments;
    Counts counts = {};
};

// The layers of a segmentation of 3D Slicer may have the same labels.
struct LabelKey {
    std::int64_t label = 0;
    std::size_t map = 0;
    auto operator<=>(const LabelKey&) const = default;
};

// A label of a map, named by the table, as a segment, or by its number.
struct Label {
    std::string name, file_name;
    std::array<double, 3> colour;
    std::int64_t samples = 0;
    bool wanted = true;
    fs::path file = {};
};
using Labels = std::map<LabelKey, Label>;

Labels labels_of(const std::vector<LabelMap>& maps, const LabelTable& given) {
    Labels labels;
    std::map<std::string, int> uses;
    for (std::size_t map = 0; map < maps.size(); ++map) {
        const LabelTable table = completed(given, maps[map].segments);
        for (const auto& [label, samples] : maps[map].counts) {
            if (label == LabelOptions{}.background) continue;
            const LabelEntry entry = label_entry(table, label);
            Label one{entry.name, file_name(entry.name), *entry.colour, samples};
            ++uses[one.file_name];
            labels.emplace(LabelKey{label, map}, std::move(one));
        }
    }
    // Names that several labels have get the label's number, as often as it takes to be unique.
    const auto uses_before = uses;
    for (auto& [key, one] : labels) {
        if (uses_before.at(one.file_name) == 1) continue;
        do one.file_name += fmt::format("-{}", key.label);
        while (++uses[one.file_name] > 1);
    }
    return labels;
}

// "1 liver, 2 spleen and 5 more", to choose from.
std::string list_labels(const Labels& labels) {
    constexpr std::size_t kMost = 8;
    std::string text;
    std::size_t listed = 0;
    for (const auto& [key, one] : labels) {
        if (++listed > kMost) return text + fmt::format(" and {} more", labels.size() - kMost);
        text += fmt::format("{}{} {}", text.empty() ? "" : ", ", key.label, one.name);
    }
    return text;
}

std::vector<std::string> names_of(const Labels& labels) {
    std::vector<std::string> names;
    for (const auto& [key, one] : labels) names.push_back(one.name);
    return names;
}

[[noreturn]] void throw_unknown_label(const std::string& wanted, const Labels& labels) {
    const std::string meant = did_you_mean(wanted, names_of(labels));
    throw UsageError(fmt::format("--only: the map has no label '{}'{}", wanted,
                                 meant.empty() ? ": it has " + list_labels(labels) : meant));
}

std::string trimmed(const std::string& text) {
    const std::size_t begin = std::min(text.find_first_not_of(' '), text.size());
    return text.substr(begin, text.find_last_not_of(' ') + 1 - begin);
}

// Marks the labels in `only` as wanted: numbers or names in any case, separated by commas. A name may itself
// contain commas. The number of a label goes before names.
void choose_labels(const std::string& only, Labels& labels) {
    for (auto& [key, one] : labels) one.wanted = false;
    const auto choose_one = [&](const std::string& wanted) {
        bool found = false;
        for (auto& [key, one] : labels) {
            if (wanted == std::to_string(key.label)) one.wanted = found = true;
        }
        if (found) return true;
        for (auto& [key, one] : labels) {
            if (lower_case(wanted) == lower_case(one.name)) one.wanted = found = true;
        }
        return found;
    };
    if (choose_one(only)) return;
    bool any = false;
    for (std::size_t begin = 0; begin <= only.size();) {
        const std::size_t end = std::min(only.find(',', begin), only.size());
        const std::string wanted = trimmed(only.substr(begin, end - begin));
        begin = end + 1;
        if (wanted.empty()) continue;
        if (!choose_one(wanted)) throw_unknown_label(wanted, labels);
        any = true;
    }
    if (!any) throw_unknown_label(only, labels);
}

std::vector<fs::path> files_of(const LabelsOptions& options, const std::vector<std::string>& names) {
    return surface_files(options.job.output.mesh, options.job.output.space, names);
}

// The labels, and whether there are several, are not known before the map is read. Until then, one stands for
// all.
std::vector<fs::path> file_pattern(const LabelsOptions& options) {
    return files_of(options, {"{name}"});
}

// Gives each label that is wanted its file.
void name_files(const LabelsOptions& options, Labels& labels) {
    std::vector<Label*> wanted;
    std::vector<std::string> names;
    for (auto& [key, one] : labels) {
        if (!one.wanted) continue;
        wanted.push_back(&one);
        names.push_back(one.file_name);
    }
    const std::vector<fs::path> files = files_of(options, names);
    for (std::size_t i = 0; i < wanted.size(); ++i) {
        check_output(files[i], options.job.scan.path);
        wanted[i]->file = files[i];
    }
}

// The thousands of surfaces of a scan would take minutes, and nobody wants them.
void refuse_scan(const fs::path& input, const LabelMap& map) {
    constexpr std::size_t kMany = 32;
    const Counts& counts = map.counts;
    if (counts.size() <= kMany) return;
    std::int64_t background = LabelOptions{}.background;
    // Scans with negative values may be clipped at one of them, which then is the most frequent.
    if (counts.begin()->first < background)
        background = std::max_element(counts.begin(), counts.end(), [](const auto& a, const auto& b) {
                         return a.second < b.second;
                     })->first;
    if (!has_equal_neighbours(map.samples, background))
        throw UsageError(fmt::format(
            "'{}' looks like a scan, not like a label map: it has {} different values, from {} to {}, and "
            "neighbours mostly differ; extract an isosurface with --isovalue, or name labels with --only",
            input.string(), counts.size(), counts.begin()->first, counts.rbegin()->first));
}

void warn_of_table(const fs::path& file, const LabelTable& table, const Labels& labels,
                   std::vector<std::string>& warnings) {
    const bool any = std::any_of(labels.begin(), labels.end(),
                                 [&](const auto& entry) { return table.contains(entry.first.label); });
    if (!file.empty() && !any)
        warnings.push_back(fmt::format("'{}' has none of the map's labels", file.string()));
}

// Smoothing shrinks structures that are only a few samples thick.
void warn_of_loss(const std::vector<Surface>& surfaces, std::vector<std::string>& warnings) {
    constexpr double kLarge = -10;  // %
    std::size_t shrunken = 0;
    const Surface* worst = nullptr;
    for (const Surface& surface : surfaces) {
        if (surface.label_volume.change() > kLarge) continue;
        ++shrunken;
        if (!worst || surface.label_volume.change() < worst->label_volume.change()) worst = &surface;
    }
    if (worst)
        warnings.push_back(
            fmt::format("{} of {} surfaces enclose at least a tenth less than their samples, {} most: "
                        "{:+.0f} %; structures that are only a few samples thick shrink",
                        shrunken, surfaces.size(), worst->name, worst->label_volume.change()));
}

// The label maps of the scan: one, or all those of a segmentation, whose segments may overlap.
std::vector<LabelMap> read_maps(const LabelsOptions& options, SurfaceJob& job) {
    const FilterSteps steps{.crop = options.crop};
    const bool all = options.segmentation && !options.job.scan.options.volume;
    const ScanInfo& info = job.results.info;
    std::vector<LabelMap> maps;
    do {
        Volume map =
            all ? job.read_volume(static_cast<std::int64_t>(maps.size()), steps) : job.read_scan(steps);
        maps.push_back({std::move(map), info.series.labels});
    } while (all && maps.size() < static_cast<std::size_t>(info.volumes));
    return maps;
}

// All labels are extracted, so that a surface does not depend on which of its neighbours are wanted.
void extract(const LabelOptions& options, const Volume& samples, std::size_t map, const Labels& labels,
             std::vector<Surface>& surfaces) {
    for (LabelSurface& found : extract_labels(samples, options)) {
        const Label& label = labels.at({found.label, map});
        if (!label.wanted) continue;
        Surface& surface = surfaces.emplace_back(Surface{label.name, 0, std::move(found.mesh), label.file});
        surface.colour = label.colour;
        surface.label = found.label;
        surface.label_volume.samples = label.samples;
        surface.held_back = found.held_back_points;
    }
}

void measure_volumes(const Mat3d& index_to_physical, int threads, const Progress& progress,
                     std::vector<Surface>& surfaces) {
    const Mat3d& step = index_to_physical;
    const double sample_mm3 = std::abs(dot(step[0], cross(step[1], step[2])));
    double done = 0;
    for (Surface& surface : surfaces) {
        report(progress, done++ / static_cast<double>(surfaces.size()));
        surface.measures = measure(surface.mesh, {.threads = threads});
        LabelVolume& volume = surface.label_volume;
        volume.samples_mm3 = static_cast<double>(volume.samples) * sample_mm3;
        volume.enclosed_mm3 = surface.measures->volume;
    }
}

}  // namespace

void add_options(Arguments& arguments, LabelsOptions& options) {
    Value table = file_value("[TABLE]", options.table);
    table.may_be_left = true;
    arguments.add_option(
        "--labels", std::move(table),
        "INPUT is a label map, as a segmentation of DICOM or 3D Slicer always is: extract a surface for "
        "each label. TABLE holds names and colours, "
        "as 3D Slicer or ITK-SNAP writes them, or one 'LABEL NAME' a line.");
    arguments.add_option("--relax", integer_value("N", options.relax, 0, std::numeric_limits<int>::max()),
                         "Smooth the surfaces of labels with N passes; default: 40, 0: none.");
    arguments.add_option("--only", text_value("LABEL[,LABEL]", options.only),
                         "Write only the labels with these numbers or names.");
}

void check(const LabelsOptions& options) {
    file_pattern(options);
}

void run(const LabelsOptions& options, const Console& console, const std::atomic<bool>& stop) {
    SurfaceJob job(options.job, console, stop);
    const std::vector<fs::path> pattern = file_pattern(options);
    job.check_outputs(pattern);
    const LabelTable given = options.table.empty() ? LabelTable{} : read_label_table(options.table);

    std::vector<LabelMap> maps = read_maps(options, job);
    SurfaceResults& results = job.results;
    for (LabelMap& map : maps) {
        job.stage("count", [&](const Progress& progress) {
            map.counts = count_labels(map.samples, {.threads = job.threads(), .progress = progress});
        });
    }
    Labels labels = labels_of(maps, given);
    if (labels.empty())
        throw EmptySurface(fmt::format("{} only background, so there is no surface",
                                       options.crop ? "the box of --crop holds" : "the map holds"));
    if (options.only)
        choose_labels(*options.only, labels);
    else if (!options.segmentation)
        refuse_scan(options.job.scan.path, maps[0]);
    name_files(options, labels);
    warn_of_table(options.table, given, labels, results.warnings);
    job.print_warnings();

    for (std::size_t map = 0; map < maps.size(); ++map) {
        results.seconds.extract += job.stage("extract", [&](const Progress& progress) {
            extract({.relax = options.relax,
                     .normals = job.shows_normals(pattern),
                     .threads = job.threads(),
                     .progress = progress},
                    maps[map].samples, map, labels, results.surfaces);
        });
    }
    std::stable_sort(results.surfaces.begin(), results.surfaces.end(),
                     [](const Surface& a, const Surface& b) { return *a.label < *b.label; });
    const Geometry& geometry = maps[0].samples.geometry();
    job.stage("measure", [&](const Progress& progress) {
        measure_volumes(geometry.index_to_physical(), job.threads(), progress, results.surfaces);
    });
    warn_of_loss(results.surfaces, results.warnings);
    warn_of_rounding(geometry, results.warnings);
    warn_of_coinciding_points(results.surfaces, "if that matters, write .3mf or .ply", results.warnings);
    job.deliver();
}

}  // namespace marrow::apps
