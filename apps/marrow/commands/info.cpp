// Inspects scans and reads their samples.
#include "info.h"

#include <algorithm>
#include <optional>
#include <ostream>

#include <vtkImageData.h>
#include <vtkNew.h>

#include <marrow/atomic_file.h>
#include <marrow/histogram.h>
#include <marrow/labels.h>
#include <marrow/printable.h>
#include <marrow/scan_io.h>
#include <marrow/tissue_presets.h>

#include "info_report.h"
#include "json_report.h"
#include "png.h"
#include "progress_reporter.h"
#include "shared/label_map.h"
#include "shared/library_options.h"
#include "shared/output_checks.h"
#include "shared/thumbnail.h"

namespace marrow::apps {
namespace fs = std::filesystem;
namespace {

void add_labels(const Volume& map, const LabelTable& segments, SampleReport& report) {
    for (const auto& [label, samples] : count_labels(map)) {
        if (label == LabelOptions{}.background) continue;
        const auto segment = segments.find(label);
        report.labels.push_back(
            {label, samples, segment == segments.end() ? std::nullopt : std::optional(segment->second.name)});
        report.upper = std::max(report.upper, static_cast<double>(label));
    }
    std::stable_sort(report.labels.begin(), report.labels.end(),
                     [](const auto& a, const auto& b) { return a.label < b.label; });
}

// `hounsfield` is what the headers say about the unit.
SampleReport report_on(const Volume& scan, const ScanInfo& info, const std::optional<bool>& hounsfield) {
    SampleReport report;
    report.type = scan.type();
    report.rescale = scan.rescale();
    const Histogram samples = histogram(scan);
    report.lower = samples.lower;
    report.upper = samples.upper;
    report.finite = scan.geometry().sample_count() - samples.non_finite_samples;
    report.may_be_hounsfield = report.finite > 0 && hounsfield.value_or(presets_apply(
                                                        info.series.modality, info.format, samples.lower));
    if (is_label_map(scan, info.series)) add_labels(scan, info.series.labels, report);
    return report;
}

void write_thumbnail(const Volume& scan, const fs::path& file) {
    constexpr int kPixels = 256;
    const auto [width, height, grey] = draw_thumbnail(scan, scan.geometry().direction, kPixels);
    vtkNew<vtkImageData> image;
    image->SetDimensions(width, height, 1);
    image->AllocateScalars(VTK_UNSIGNED_CHAR, 1);
    for (int y = 0; y < height; ++y)  // VTK counts rows from the bottom
        std::copy_n(&grey[static_cast<std::size_t>(y * width)], width,
                    static_cast<unsigned char*>(image->GetScalarPointer(0, height - 1 - y, 0)));
    const std::string png = png_of(image);
    AtomicFile out(file);
    out.write(png.data(), png.size());
    out.commit();
}

// Where the segments of a segmentation overlap, the library reads one of its label maps, and the program
// makes the surfaces of all. So no such series is refused for that, and the one that would be read is
// described by its first map. Returns whether this is so.
bool describe_all_maps(const fs::path& input, ScanOptions scan, ScanReport& report) {
    if (report.chosen || scan.volume) return false;
    bool any_overlap = false;
    for (SeriesReport& s : report.series) {
        if (s.volumes.size() < 2 || s.series.labels.empty()) continue;
        s.refusal.reset();
        any_overlap = true;
    }
    if (!any_overlap) return false;
    scan.volume = 0;
    ScanReport first = inspect_scan(input, scan);
    if (!first.chosen || first.series[*first.chosen].series.labels.empty()) return false;
    report.chosen = first.chosen;
    report.reason = first.reason;
    report.series[*first.chosen] = std::move(first.series[*first.chosen]);
    return true;
}

// Inspects the input, and reads the samples of the series that would be read.
void inspect(const InfoCommandOptions& options, const ProgressReporter& reporter, Finding& finding) {
    ScanOptions scan = options.scan;
    bool all_maps = false;
    reporter.stage("inspect", [&](const Progress& progress) {
        scan.progress = progress;
        ScanReport& report = finding.report.emplace(inspect_scan(finding.input, scan));
        all_maps = describe_all_maps(finding.input, scan, report);
    });
    const bool is_chosen = finding.report->chosen.has_value();
    // If nothing is chosen, the attempt to read it says why there is no picture.
    if (options.headers || (!is_chosen && options.picture.empty())) return;
    reporter.stage("read", [&](const Progress& progress) {
        scan.progress = progress;
        ScanInfo info;
        if (all_maps) scan.volume = 0;
        const Volume volume = read_scan(finding.input, scan, &info);
        check_is_no_slice(options.picture, finding.input, info.format);
        if (is_chosen) {
            const ScanReport& report = *finding.report;
            finding.samples = report_on(volume, info, report.series[*report.chosen].hounsfield);
        }
        for (std::int64_t map = 1; all_maps && map < info.volumes; ++map) {
            scan.volume = map;
            const Volume layer = read_scan(finding.input, scan, &info);
            add_labels(layer, info.series.labels, *finding.samples);
        }
        if (!options.picture.empty()) write_thumbnail(volume, options.picture);
    });
}

}  // namespace

void add_options(Arguments& arguments, InfoCommandOptions& options) {
    arguments.add_inputs("INPUT", options.inputs, kScanHelp);
    add_scan_options(arguments, options.scan);
    arguments.start_group("Output");
    arguments.add_option("--picture", file_value("FILE.png", options.picture, ".png"),
                         "Write a picture of the middle slice of the series that would be read.");
    arguments.add_flag("--headers", options.headers,
                       "Read only the headers: quicker, but without the range of the values.");
    arguments.add_flag("--show-patient", options.show_patient, "Print the names of patients.");
    add_json_option(arguments, options.reporting);
}

ExitCode run(const InfoCommandOptions& options, const Console& console, const std::atomic<bool>& stop) {
    if (!options.picture.empty() && options.headers)
        throw UsageError("--picture shows samples, which --headers leaves out: omit one of them");
    if (!options.picture.empty() && options.inputs.size() > 1) throw UsageError("--picture takes one INPUT");
    check_output(options.picture, options.inputs.front());
    const ProgressReporter reporter(options.reporting, console, stop);
    std::vector<Finding> findings;
    for (const fs::path& input : options.inputs) {
        Finding& finding = findings.emplace_back(Finding{input, {}, {}, {}});
        try {
            inspect(options, reporter, finding);
        } catch (const Cancelled&) {
            throw;
        } catch (const Error& error) {
            finding.failure = Failure{error.what(), exit_code_of(error)};
            console.error(name_flags(error.what()));
        }
        if (options.reporting.json || !finding.report) continue;
        if (options.inputs.size() > 1) console.out << printable(input.string()) << ": ";
        print_finding(console.out, finding, options.show_patient);
    }
    if (options.reporting.json) console.out << findings_json(findings, options.show_patient);
    const Failure* failure = decisive_failure(findings);
    return failure ? failure->exit_code : kOk;
}

}  // namespace marrow::apps
