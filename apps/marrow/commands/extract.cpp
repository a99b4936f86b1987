// Extracts isosurfaces of a scan that is read into memory.
#include "extract.h"

#include <algorithm>

#include <fmt/format.h>

#include <marrow/gpu.h>
#include <marrow/histogram.h>
#include <marrow/isosurface.h>

#include "outputs.h"
#include "shared/label_map.h"
#include "shared/sample_text.h"
#include "shared/surface_warnings.h"
#include "warnings.h"

namespace marrow::apps {
namespace {

Value isovalue_value(std::vector<SurfaceRequest>& to) {
    const auto store = [&to](const std::string& text) {
        const std::optional<double> isovalue = parse_number(text);
        to.push_back({text, isovalue});
        return isovalue || text == "otsu";
    };
    return {.name = "N|otsu", .expected = "a finite number or 'otsu'", .store = store, .may_repeat = true};
}

Value preset_value(std::vector<SurfaceRequest>& to) {
    const auto store = [&to](const std::string& text) {
        const std::string name = lower_case(text);
        const Preset* preset = find_preset(name);
        to.push_back({name, {}, preset});
        return preset != nullptr;
    };
    return {
        .name = "TYPE", .expected = "bone, skin, soft, fat or muscle", .store = store, .may_repeat = true};
}

// Presets are Hounsfield units, which only CT has. Formats that do not state the modality pass if they
// contain air. The returned warning states this assumption.
std::string check_presets(const std::vector<SurfaceRequest>& surfaces, const ScanInfo& info,
                          const Volume& scan) {
    const auto has_preset = [](const SurfaceRequest& request) { return request.preset != nullptr; };
    const auto first = std::find_if(surfaces.begin(), surfaces.end(), has_preset);
    if (first == surfaces.end() || info.series.modality == "CT") return {};

    const auto refuse = [&](const std::string& reason) {
        throw UsageError(
            fmt::format("--type {} is in Hounsfield units, which only CT has, and {}: use --isovalue otsu "
                        "or --isovalue N",
                        first->name, reason));
    };
    if (is_label_map(scan, info.series))
        throw UsageError(
            fmt::format("--type {} is for CT, and this looks like a label map: make a surface of "
                        "each label with --labels",
                        first->name));
    const double lowest = histogram(scan).lower;
    if (!presets_apply(info.series.modality, info.format, lowest)) {
        if (!info.series.modality.empty()) refuse("this scan's modality is " + info.series.modality);
        if (info.format == ScanFormat::dicom) refuse("this scan does not state its modality");
        refuse(fmt::format("{} does not say whether this is CT, and its lowest sample, {}, is not air",
                           scan_format_name(info.format), value_text(lowest)));
    }
    return assumed_hounsfield_warning(info.format, lowest);
}

// The scan is read first, to tell which options suit it.
[[noreturn]] void throw_no_surface(const ScanInfo& info, const Volume& scan) {
    if (is_label_map(scan, info.series))
        throw UsageError(
            "no surface is given, and this looks like a label map: make a surface of each label with "
            "--labels, or one of all with --isovalue 0.5");
    const bool is_ct = presets_apply(info.series.modality, info.format, histogram(scan).lower);
    throw UsageError(fmt::format("no surface is given: add --isovalue N, --isovalue otsu{}",
                                 is_ct ? ", or for CT --type bone" : ""));
}

void check_surfaces(const std::vector<SurfaceRequest>& surfaces) {
    for (auto surface = surfaces.begin(); surface != surfaces.end(); ++surface) {
        const auto same = std::find_if(surfaces.begin(), surface, [&](const SurfaceRequest& other) {
            return other.known_isovalue() == surface->known_isovalue();
        });
        if (same == surface) continue;
        if (same->name == surface->name)
            throw UsageError(fmt::format("the surface {} is given twice", surface->name));
        throw UsageError(fmt::format("the surfaces {} and {} have the same isovalue: leave one of them out",
                                     same->name, surface->name));
    }
}

void check_finite(const Histogram& samples) {
    if (samples.counts.empty()) throw EmptySurface("the scan has no finite sample, so there is no surface");
}

double choose_isovalue(const SurfaceRequest& request, const Histogram& samples) {
    if (const auto isovalue = request.known_isovalue()) return *isovalue;
    check_finite(samples);
    try {
        return otsu_isovalue(samples);
    } catch (const InputError&) {
        throw UsageError(fmt::format(
            "--isovalue otsu separates dark from bright, and all samples are {}: give --isovalue N",
            value_text(samples.lower)));
    }
}

[[noreturn]] void throw_empty(double isovalue, const Volume& scan, bool open) {
    const auto& dims = scan.geometry().dims;
    if (open && *std::min_element(dims.begin(), dims.end()) < 2)
        throw EmptySurface("an open surface needs at least 2 samples along each axis: leave --open out");
    const Histogram samples = histogram(scan);
    check_finite(samples);
    throw EmptySurface(fmt::format("no surface at isovalue {}: samples range from {} to {}",
                                   value_text(isovalue), value_text(samples.lower),
                                   value_text(samples.upper)));
}

class Extraction {
  public:
    Extraction(const ExtractOptions& options, SurfaceJob& job, const Volume& scan, bool normals,
               bool hounsfield, Histogram for_otsu)
        : options_(options),
          job_(job),
          scan_(scan),
          normals_(normals),
          hounsfield_(hounsfield),
          for_otsu_(std::move(for_otsu)) {}

    // Copies the scan to a device, which then extracts. What it cannot do, the CPU does.
    void use_device(std::size_t device) {
        device_name_ = gpu::devices().at(device).name;
        job_.results.seconds.extract += job_.stage("upload", [&](const Progress& progress) {
            progress_ = progress;
            IsosurfaceOptions options = isosurface_options();
            options.progress = [this](double fraction) { return progress_(fraction); };
            extractor_.emplace(scan_, options, device);
        });
    }

    void extract(const SurfaceRequest& request, const std::filesystem::path& output) {
        Surface& surface = job_.results.surfaces.emplace_back();
        surface.name = request.name;
        surface.output = output;
        if (request.preset) surface.colour = request.preset->colour;
        IsosurfaceOptions extraction = isosurface_options();
        job_.results.seconds.extract += job_.stage("extract", [&](const Progress& progress) {
            IsosurfaceStats stats;
            surface.isovalue = choose_isovalue(request, for_otsu_);
            extraction.progress = progress;
            if (extractor_) {
                progress_ = progress;
                extractor_->extract(surface.isovalue, surface.mesh, 0, &stats);
                if (extractor_->on_device()) surface.device = device_name_;
            } else {
                surface.mesh = extract_isosurface(scan_, surface.isovalue, extraction, &stats);
            }
            non_finite_samples_ = stats.non_finite_samples;
            if (surface.mesh.triangles.empty()) throw_empty(surface.isovalue, scan_, options_.open);
        });
        const bool is_bone = request.preset && request.preset->name == "bone";
        if (options_.trust.look_for_walls(is_bone))
            job_.results.seconds.extract += job_.stage("thin walls", [&](const Progress& progress) {
                extraction.progress = progress;
                look_for_thin_walls(surface, scan_, noise(progress), job_.results.info.padding,
                                    options_.trust.keep_thin, extraction);
            });
        if (options_.steps.any()) refine(surface);
        if (options_.trust.report)
            job_.results.seconds.refine += job_.stage("trust", [&](const Progress& progress) {
                add_trust(surface, scan_, hounsfield_,
                          {.noise = noise(progress),
                           .padding = job_.results.info.padding,
                           .threads = job_.threads(),
                           .progress = progress});
            });
    }

    void add_warnings() {
        SurfaceResults& results = job_.results;
        if (extractor_ && !extractor_->failure().empty())
            results.warnings.push_back(
                fmt::format("the CPU extracted instead of {}: {}", device_name_, extractor_->failure()));
        warn_of_non_finite(non_finite_samples_, results.warnings);
        warn_of_large_coordinates(results.surfaces, scan_.geometry(), results.warnings);
        if (!options_.open) warn_of_box(results.surfaces, scan_, results.warnings);
        for (const Surface& surface : results.surfaces) {
            if (const auto warning = thin_wall_warning(surface, options_.job.output.space))
                results.warnings.push_back(*warning);
        }
    }

  private:
    IsosurfaceOptions isosurface_options() const {
        return {.normals = normals_,
                .closed = !options_.open,
                .snap = options_.snap,
                .topology = options_.topology,
                .threads = job_.threads()};
    }

    void refine(Surface& surface) {
        job_.results.seconds.refine += job_.stage("refine", [&](const Progress& progress) {
            surface.steps = refine_surface(surface.mesh, options_.steps, scan_.geometry().index_to_physical(),
                                           options_.job.reporting.json, job_.threads(), progress);
            for (StepReport& step : surface.steps) step.encloses_volume = !options_.open;
            surface.measures = surface.steps.back().after.measures;
            if (surface.mesh.triangles.empty())
                throw EmptySurface(fmt::format("no component of the surface at isovalue {} encloses {:g} mm3",
                                               value_text(surface.isovalue), options_.steps.min_volume));
        });
        for (const StepReport& step : surface.steps) {
            if (!step.note.empty())
                job_.results.warnings.push_back(fmt::format("{}: {}", step.name, step.note));
        }
    }

    // It is that of the scan, so all surfaces share it.
    const NoiseEstimate& noise(const Progress& progress) {
        // How long the rest of the stage takes is not known.
        const Progress waiting = [&](double) { return progress(0); };
        if (!noise_)
            noise_ = estimate_noise(
                scan_,
                {.padding = job_.results.info.padding, .threads = job_.threads(), .progress = waiting});
        return *noise_;
    }

    const ExtractOptions& options_;
    SurfaceJob& job_;
    const Volume& scan_;
    const bool normals_;
    const bool hounsfield_;
    const Histogram for_otsu_;  // empty if no surface needs it
    std::optional<NoiseEstimate> noise_;
    std::int64_t non_finite_samples_ = 0;
    std::string device_name_;
    Progress progress_;                                // of the stage in which the extractor works
    std::optional<gpu::FallbackExtractor> extractor_;  // none: the CPU was asked for
};

std::vector<std::filesystem::path> files_of(const ExtractOptions& options) {
    std::vector<std::string> names;
    for (const SurfaceRequest& surface : options.surfaces()) names.push_back(surface.name);
    return surface_files(options.job.output.mesh, options.job.output.space, names);
}

}  // namespace

std::optional<double> SurfaceRequest::known_isovalue() const {
    return preset ? preset->isovalue() : isovalue;
}

std::vector<SurfaceRequest> ExtractOptions::surfaces() const {
    std::vector<SurfaceRequest> all = isovalues;
    all.insert(all.end(), presets.begin(), presets.end());
    return all;
}

void add_surface_options(Arguments& arguments, ExtractOptions& options) {
    arguments.start_group("Surface");
    arguments.add_option(
        "--isovalue", isovalue_value(options.isovalues),
        "Extract the surface where samples reach N, or where Otsu's method separates dark from "
        "bright. May be repeated.");
    arguments.add_option("--type", preset_value(options.presets),
                         "Extract the surface of a tissue in CT: bone, skin, soft, fat or muscle. May be "
                         "repeated.");
    arguments.add_flag("--open", options.open, "Leave the surface open at the border of the scan.");
    arguments.add_option(
        "--snap",
        number_value("T", "a fraction of an edge, 0 <= T < 0.5", options.snap,
                     [](double x) { return x >= 0 && x < 0.5; }),
        "Merge points around samples that are closer to the surface than T edge lengths, 0 <= T "
        "< 0.5: fewer points and no slivers. 0 (default) is off; 0.3 is a good value.");
    arguments.add_flag(
        "--topology", options.topology,
        "Give the surface exactly the pieces, holes and handles of the trilinear interpolant: thin "
        "walls stay whole. Not with --snap.");
    add_trust_options(arguments, options.trust);
}

void add_step_options(Arguments& arguments, ExtractOptions& options) {
    arguments.start_group("Before extraction");
    add_filter_options(arguments, options.filters, "the axes of --space");
    arguments.start_group("After extraction");
    add_surface_options(arguments, options.steps);
}

void check(const ExtractOptions& options) {
    check_surfaces(options.surfaces());
    check_steps(options.steps);
    check_trust(options.trust);
    if (options.topology && options.snap > 0)
        throw UsageError("--topology does not go with --snap: leave one of them out");
    files_of(options);  // so that mistakes in the output are found before the work
}

void run(const ExtractOptions& options, const Console& console, const std::atomic<bool>& stop) {
    SurfaceJob job(options.job, console, stop);
    const std::vector<std::filesystem::path> files = files_of(options);
    job.check_outputs(files);
    const std::optional<std::size_t> device = gpu::choose_device(options.device);
    const std::vector<SurfaceRequest> surfaces = options.surfaces();

    // Presets are checked against the samples as they are in the scan, before any filter.
    std::string assumption;
    bool hounsfield = false;
    Histogram for_otsu;
    const Volume scan = job.read_scan(
        options.filters,
        [&](const Volume& unfiltered) {
            if (surfaces.empty()) throw_no_surface(job.results.info, unfiltered);
            assumption = check_presets(surfaces, job.results.info, unfiltered);
            const ScanInfo& info = job.results.info;
            if (!options.trust.report) return;
            const double lowest = histogram(unfiltered).lower;
            hounsfield = presets_apply(info.series.modality, info.format, lowest);
            if (hounsfield && info.series.modality != "CT")
                assumption = assumed_hounsfield_warning(info.format, lowest);
        },
        [&](const Volume& unmixed) {
            const bool needed =
                std::any_of(surfaces.begin(), surfaces.end(),
                            [](const SurfaceRequest& surface) { return !surface.known_isovalue(); });
            if (needed) for_otsu = histogram(unmixed, 256, job.results.info.padding);
        });
    if (!assumption.empty()) job.results.warnings.push_back(assumption);
    job.results.surfaces.reserve(surfaces.size());
    Extraction extraction(options, job, scan, job.shows_normals(files), hounsfield, std::move(for_otsu));
    if (device) extraction.use_device(*device);
    for (std::size_t i = 0; i < surfaces.size(); ++i) extraction.extract(surfaces[i], files[i]);
    extraction.add_warnings();
    job.deliver();
}

}  // namespace marrow::apps
