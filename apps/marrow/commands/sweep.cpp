// Measures the surfaces of many isovalues.
#include "sweep.h"

#include <algorithm>
#include <ostream>

#include <fmt/format.h>

#include <marrow/atomic_file.h>
#include <marrow/histogram.h>
#include <marrow/isovalue_sweep.h>
#include <marrow/scan_io.h>

#include "json_report.h"
#include "progress_reporter.h"
#include "shared/output_checks.h"
#include "shared/sample_text.h"
#include "sweep_report.h"
#include "warnings.h"

namespace marrow::apps {
namespace fs = std::filesystem;
namespace {

void write_file(const fs::path& file, const std::string& text) {
    AtomicFile out(file);
    out.write(text);
    out.commit();
}

Value table_value(fs::path& to) {
    return {"OUT", "a .csv or .json file", [&to](const std::string& text) {
                to = text;
                return to.empty() || to.extension() == ".csv" || to.extension() == ".json";
            }};
}

Value plot_value(fs::path& to) {
    return {"FILE", "a .svg or .png file", [&to](const std::string& text) {
                to = text;
                return to.extension() == ".svg" || to.extension() == ".png";
            }};
}

void check(const SweepCommandOptions& options) {
    require_input(options.scan.path, "marrow sweep");
    if (options.from && options.to && !(*options.from < *options.to))
        throw UsageError("--from must be below --to");
    check_output(options.table, options.scan.path);
    check_output(options.plot, options.scan.path);
}

// `samples` receives those that are not padding, before blurring mixes padding with them.
Volume read(const SweepCommandOptions& options, const ProgressReporter& reporter, ScanInfo& info,
            Histogram& samples) {
    Volume scan;
    const Inspect inspect = [&](const Volume& unmixed) { samples = histogram(unmixed, 256, info.padding); };
    reporter.stage("read", [&](const Progress& progress) {
        ScanOptions scan_options = options.scan.options;
        scan_options.progress = progress;
        scan = read_scan(options.scan.path, scan_options, &info);
    });
    check_is_no_slice(options.plot, options.scan.path, info.format);
    if (options.filters.any())
        reporter.stage("filter", [&](const Progress& progress) {
            filter_scan(scan, options.filters, options.scan.options.threads, progress, inspect);
        });
    else
        inspect(scan);
    return scan;
}

// Evenly spaced, including both ends, and fewer where there are not so many numbers between them.
std::vector<double> choose_isovalues(const SweepCommandOptions& options, const Histogram& samples) {
    if (samples.counts.empty()) throw EmptySurface("the scan has no finite sample, so there is no surface");
    const double from = options.from.value_or(samples.lower), to = options.to.value_or(samples.upper);
    if (!(from < to))
        throw EmptySurface(fmt::format(
            "there are no isovalues between {} and {}; samples range from {} to {}", value_text(from),
            value_text(to), value_text(samples.lower), value_text(samples.upper)));
    std::vector<double> isovalues;
    // A double could not hold the difference of the largest numbers.
    const long double step = (static_cast<long double>(to) - from) / (options.samples - 1);
    for (int i = 0; i + 1 < options.samples; ++i) isovalues.push_back(static_cast<double>(from + i * step));
    isovalues.push_back(to);
    isovalues.erase(std::unique(isovalues.begin(), isovalues.end()), isovalues.end());
    return isovalues;
}

void write(const SweepCommandOptions& options, const Console& console,
           const std::vector<SweepSample>& measured, const std::vector<Plateau>& plateaus) {
    if (!options.table.empty())
        write_file(options.table, options.table.extension() == ".json" ? sweep_json(measured, plateaus)
                                                                       : sweep_csv(measured, plateaus));
    if (!options.plot.empty()) {
        const Drawing drawing = sweep_drawing(measured, plateaus);
        write_file(options.plot, options.plot.extension() == ".png" ? png_of(drawing) : svg_of(drawing));
    }
    if (options.reporting.json) {
        console.out << sweep_json(measured, plateaus);
    } else if (!options.reporting.quiet && options.table.empty()) {
        console.out << sweep_csv(measured, plateaus);
    } else if (!options.reporting.quiet) {
        for (const Plateau& p : plateaus)
            console.out << fmt::format("plateau from {} to {}\n", value_text(measured[p.first].isovalue),
                                       value_text(measured[p.last].isovalue));
        if (plateaus.empty()) console.out << "no plateau\n";
    }
}

}  // namespace

const char* const kSweepHelp =
    "A plateau is a range of isovalues in which the surface hardly depends on the isovalue. It is at\n"
    "least a fifth of the scan's contrast wide (the contrast between the two classes of 'otsu'), and\n"
    "each such fifth moves the surface by less than half a sample (mm: change of volume over area).\n";

void add_options(Arguments& arguments, SweepCommandOptions& options) {
    const auto any = [](double) { return true; };
    add_scan_input(arguments, options.scan);
    add_scan_options(arguments, options.scan.options);
    arguments.start_group("Before measuring");
    add_filter_options(arguments, options.filters, "the LPS axes");
    arguments.start_group("Isovalues");
    arguments.add_option("--from", number_value("A", "a finite number", options.from, any),
                         "First isovalue; default: the least sample that is not padding.");
    arguments.add_option("--to", number_value("B", "a finite number", options.to, any),
                         "Last isovalue; default: the largest sample that is not padding.");
    arguments.add_option("-n,--samples", integer_value("N", options.samples, 2, 100'000),
                         "Measure N isovalues, evenly spaced from A to B; default: 100.");
    arguments.add_flag("--topology", options.topology,
                       "Measure the surfaces that marrow INPUT --topology gives; takes longer.");
    arguments.start_group("Output");
    arguments.add_option("-o,--output", table_value(options.table),
                         "Write the table to OUT, .csv or .json, instead of printing it.");
    arguments.add_option("--plot", plot_value(options.plot), "Write a drawing to FILE, .svg or .png.");
    add_general_options(arguments, options.scan.options.threads, options.reporting);
}

void run(const SweepCommandOptions& options, const Console& console, const std::atomic<bool>& stop) {
    check(options);
    const ProgressReporter reporter(options.reporting, console, stop);
    ScanInfo info;
    Histogram samples;
    const Volume scan = read(options, reporter, info, samples);
    std::vector<std::string> warnings = info.warnings;
    warn_of_non_finite(samples.non_finite_samples, warnings);
    for (const std::string& warning : warnings) reporter.warn(warning);

    const std::vector<double> isovalues = choose_isovalues(options, samples);
    std::vector<SweepSample> measured;
    reporter.stage("sweep", [&](const Progress& progress) {
        measured = sweep_isovalues(
            scan, isovalues,
            {.threads = options.scan.options.threads, .progress = progress, .topology = options.topology});
    });
    if (std::all_of(measured.begin(), measured.end(), [](const SweepSample& s) { return s.triangles == 0; }))
        throw EmptySurface(fmt::format("no surface at isovalues from {} to {}: samples range from {} to {}",
                                       value_text(isovalues.front()), value_text(isovalues.back()),
                                       value_text(samples.lower), value_text(samples.upper)));
    const Vec3d& spacing = scan.geometry().spacing;
    const double finest = *std::min_element(spacing.begin(), spacing.end());
    write(options, console, measured, find_plateaus(measured, finest, otsu_contrast(samples)));
}

}  // namespace marrow::apps
