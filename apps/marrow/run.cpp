#include <algorithm>
#include <map>
#include <ostream>

#include <fmt/format.h>

#include <marrow/histogram.h>
#include <marrow/isosurface.h>
#include <marrow/mesh_io.h>
#include <marrow/scan_io.h>
#include <marrow/streaming.h>

#include "check_run.h"
#include "labels_run.h"
#include "picture.h"
#include "report.h"
#include "run.h"
#include "sweep_run.h"
#include "voice.h"
#include "warnings.h"

namespace marrow {
namespace fs = std::filesystem;
namespace {

// Presets are Hounsfield units, which only CT has. Formats without a modality pass if they hold air; the
// returned text says that this was assumed.
std::string check_presets(const Settings& settings, const ScanInfo& info, const Volume& scan) {
    const auto has_preset = [](const SurfaceRequest& request) { return request.preset != nullptr; };
    const auto first = std::find_if(settings.surfaces.begin(), settings.surfaces.end(), has_preset);
    if (first == settings.surfaces.end() || info.series.modality == "CT") return {};

    const auto refuse = [&](const std::string& reason) {
        throw UsageError(
            fmt::format("--type {} is in Hounsfield units, which only CT has, and {}: use --isovalue otsu "
                        "or --isovalue N",
                        first->name, reason));
    };
    const double lowest = histogram(scan).lower;
    if (!presets_apply(info.series.modality, info.format, lowest)) {
        if (!info.series.modality.empty()) refuse("this scan's modality is " + info.series.modality);
        if (info.format == ScanFormat::dicom) refuse("this scan does not state its modality");
        refuse(fmt::format("{} does not say whether this is CT, and its lowest sample, {:g}, is not air",
                           scan_format_name(info.format), lowest));
    }
    return fmt::format(
        "{} does not say whether this is CT; its samples are taken for Hounsfield units because the "
        "lowest, {:g}, looks like air",
        scan_format_name(info.format), lowest);
}

double choose_isovalue(const SurfaceRequest& request, const Volume& scan) {
    if (request.preset) return request.preset->isovalue();
    return request.isovalue ? *request.isovalue : otsu_isovalue(histogram(scan));
}

[[noreturn]] void throw_empty(double isovalue, const Volume& scan) {
    const Histogram samples = histogram(scan);
    if (samples.counts.empty()) throw EmptySurface("the scan has no finite sample, so there is no surface");
    throw EmptySurface(fmt::format("no surface at isovalue {:g}: samples range from {:g} to {:g}", isovalue,
                                   samples.lower, samples.upper));
}

// The surface of the highest isovalue lies innermost; those around it are drawn translucent.
void draw(const std::vector<Surface>& surfaces, const Settings& settings, const Progress& progress) {
    constexpr std::array<double, 3> kNeutral{0.80, 0.81, 0.80};
    double innermost = surfaces.front().isovalue;
    for (const Surface& surface : surfaces) innermost = std::max(innermost, surface.isovalue);
    std::vector<PictureSurface> drawn;
    for (std::size_t i = 0; i < surfaces.size(); ++i) {
        const Preset* preset = settings.surfaces[i].preset;
        drawn.push_back(
            {&surfaces[i].mesh, preset ? preset->colour : kNeutral, surfaces[i].isovalue < innermost});
    }
    write_picture(drawn, settings.picture, progress);
}

// Meshes that were made of a folder may lie in it; other files there are the scan.
bool is_of_scan(const fs::path& file, const fs::path& input) {
    std::error_code none;
    if (!fs::is_directory(input, none)) return fs::equivalent(file, input, none);
    if (!fs::exists(file, none)) return false;
    const std::string ending = file.extension().string();
    return (ending == ".png" || ending == ".csv" || ending == ".json" || ending == ".svg") &&
           fs::equivalent(fs::absolute(file, none).parent_path(), input, none);
}

std::map<fs::path, std::vector<MeshObject>> objects_by_file(const std::vector<Surface>& surfaces) {
    std::map<fs::path, std::vector<MeshObject>> objects;
    for (const Surface& surface : surfaces) {
        if (!surface.output.empty())
            objects[surface.output].push_back({&surface.mesh, surface.name, surface.colour});
    }
    return objects;
}

void extract(const Settings& settings, const Console& console, Voice& voice) {
    const Clock::time_point start = Clock::now();
    const std::vector<fs::path> files = output_files(settings);
    for (const fs::path& file : files) check_output(file, settings.inputs.front());
    check_output(settings.picture, settings.inputs.front());
    if (!settings.picture.empty()) require_display();

    StageSeconds seconds;
    ScanInfo info;
    Volume scan;
    seconds.read = voice.stage("read", [&](const Progress& progress) {
        ScanOptions options = scan_options(settings);
        options.progress = progress;
        scan = read_scan(settings.inputs.front(), options, &info);
    });
    std::vector<std::string> warnings = info.warnings;
    const std::string assumed = check_presets(settings, info, scan);
    if (!assumed.empty()) warnings.push_back(assumed);

    const Steps& steps = settings.steps;
    if (steps.change_volume())
        seconds.filter = voice.stage("filter", [&](const Progress& progress) {
            filter_scan(scan, steps, settings.threads, progress);
        });

    std::vector<Surface> surfaces;
    std::int64_t non_finite_samples = 0;
    for (std::size_t i = 0; i < settings.surfaces.size(); ++i) {
        const SurfaceRequest& request = settings.surfaces[i];
        seconds.extract += voice.stage("extract", [&](const Progress& progress) {
            IsosurfaceStats stats;
            Surface surface{request.name, choose_isovalue(request, scan), {}, files[i]};
            if (request.preset) surface.colour = request.preset->colour;
            surface.mesh = extract_isosurface(scan, surface.isovalue,
                                              {.closed = !settings.open,
                                               .snap = settings.snap,
                                               .threads = settings.threads,
                                               .progress = progress},
                                              &stats);
            non_finite_samples = stats.non_finite_samples;
            if (surface.mesh.triangles.empty()) throw_empty(surface.isovalue, scan);
            surfaces.push_back(std::move(surface));
        });
        if (steps.change_surface())
            seconds.refine += voice.stage("refine", [&](const Progress& progress) {
                Surface& surface = surfaces.back();
                surface.steps =
                    refine_surface(surface.mesh, steps, scan.geometry().index_to_physical(), progress);
                if (surface.mesh.triangles.empty())
                    throw EmptySurface(
                        fmt::format("no piece of the surface at isovalue {:g} encloses {:g} mm3",
                                    surface.isovalue, steps.components.min_volume));
            });
        for (const StepReport& step : surfaces.back().steps) {
            if (!step.note.empty()) warnings.push_back(fmt::format("{}: {}", step.name, step.note));
        }
    }
    warn_of_non_finite(non_finite_samples, warnings);
    warn_of_ties(surfaces, scan, warnings);
    if (!settings.open) warn_of_box(surfaces, scan, warnings);
    for (const std::string& warning : warnings) voice.warn(warning);

    seconds.write = voice.stage(
        "write", [&](const Progress& progress) { write_surfaces(surfaces, settings.space, progress); });
    if (settings.verify)
        seconds.verify = voice.stage(
            "verify", [&](const Progress& progress) { verify_surfaces(surfaces, settings.space, progress); });
    if (!settings.picture.empty())
        seconds.write +=
            voice.stage("picture", [&](const Progress& progress) { draw(surfaces, settings, progress); });

    seconds.total = seconds_since(start);
    if (settings.json)
        print_json(console.out, info, surfaces, settings.space, warnings, seconds);
    else if (!settings.quiet)
        print_text(console.out, surfaces);
}

// With --max-memory: reads, extracts and writes slab by slab.
void extract_in_slabs(const Settings& settings, const Console& console, Voice& voice, std::size_t memory) {
    const Clock::time_point start = Clock::now();
    const SurfaceRequest& request = settings.surfaces.front();
    Surface surface{request.name, *request.isovalue, {}, output_files(settings).front(), {}, Surface::Size{}};
    check_output(surface.output, settings.inputs.front());

    StageSeconds seconds;
    ScanInfo info;
    const SliceSource source = open_slices(settings.inputs.front(), scan_options(settings), &info);
    SurfaceWriter writer(surface.output, {settings.space, {}});
    SurfaceSink sink = writer.sink();
    const auto begin = sink.begin;
    sink.begin = [&](std::uint64_t points, std::uint64_t triangles, bool normals) {
        if (triangles == 0)
            throw EmptySurface(
                fmt::format("no surface at isovalue {:g}: no sample lies across it", surface.isovalue));
        surface.in_slabs = {points, triangles};
        begin(points, triangles, normals);
    };
    IsosurfaceStats stats;
    seconds.extract = voice.stage("extract", [&](const Progress& progress) {
        // Normals as in a surface that is extracted whole, so that the file has the same bytes.
        extract_isosurface_in_slabs(
            source, surface.isovalue, sink, {.memory = memory},
            {.closed = !settings.open, .threads = settings.threads, .progress = progress}, &stats);
    });
    seconds.write = voice.stage("write", [&](const Progress&) { writer.commit(); });

    std::vector<std::string> warnings = info.warnings;
    warn_of_non_finite(stats.non_finite_samples, warnings);
    for (const std::string& warning : warnings) voice.warn(warning);
    seconds.total = seconds_since(start);
    if (settings.json)
        print_json(console.out, info, {surface}, settings.space, warnings, seconds);
    else if (!settings.quiet)
        print_text(console.out, {surface});
}

// Looks at all inputs; one that cannot be read does not hide the others. Returns the first failure's code.
ExitCode inform(const Settings& settings, const Console& console, const std::atomic<bool>& stop) {
    ScanOptions options = scan_options(settings);
    options.progress = [&](double) { return !stop.load(std::memory_order_relaxed); };
    std::vector<Finding> findings;
    ExitCode code = kOk;
    for (const fs::path& input : settings.inputs) {
        Finding finding{input, {}, {}};
        const auto fail = [&](ExitCode failure, const char* what) {
            finding.refusal = what;
            if (code == kOk) code = failure;
        };
        try {
            finding.report = inspect_scan(input, options);
        } catch (const Cancelled&) {
            throw;
        } catch (const GeometryError& error) {
            fail(kGeometry, error.what());
        } catch (const Error& error) {
            fail(kUnreadable, error.what());
        }
        if (!settings.json && !finding.refusal.empty()) console.err << "marrow: " << finding.refusal << '\n';
        findings.push_back(std::move(finding));
    }
    if (settings.json)
        print_findings_json(console.out, findings, settings.show_patient);
    else
        print_findings(console.out, findings, settings.show_patient);
    return code;
}

}  // namespace

void check_output(const fs::path& file, const fs::path& input) {
    if (file.empty()) return;
    const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
    if (!fs::is_directory(folder))
        throw IoError(
            fmt::format("cannot write '{}': there is no folder '{}'", file.string(), folder.string()));
    if (is_of_scan(file, input))
        throw UsageError(
            fmt::format("'{}' is what the scan is read from: give another output", file.string()));
}

void write_surfaces(const std::vector<Surface>& surfaces, Space space, const Progress& progress) {
    MeshFiles files;
    for (const auto& [file, objects] : objects_by_file(surfaces))
        files.write(objects, file, {space, progress});
    files.commit();
}

void verify_surfaces(const std::vector<Surface>& surfaces, Space space, const Progress& progress) {
    for (const auto& [file, objects] : objects_by_file(surfaces)) {
        report(progress, 0);
        verify(objects, file, space);
    }
}

int run(const Settings& settings, const Console& console, const std::atomic<bool>& stop) {
    return exit_code_of(console, [&] {
        Voice voice(settings.quiet, settings.verbose, console, stop);
        if (settings.info) return inform(settings, console, stop);
        if (settings.check) return check(settings, console, voice);
        if (settings.sweep)
            sweep(settings, console, voice);
        else if (settings.labels)
            extract_label_map(settings, console, voice);
        else if (settings.max_memory)
            extract_in_slabs(settings, console, voice, *settings.max_memory);
        else
            extract(settings, console, voice);
        return kOk;
    });
}

}  // namespace marrow
