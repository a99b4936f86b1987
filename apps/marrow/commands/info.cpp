// Inspects scans and prints what they contain.
#include "info.h"

#include <algorithm>
#include <ostream>
#include <string_view>

#include <fmt/format.h>

#include <marrow/scan_io.h>

#include "json_report.h"
#include "shared/library_options.h"

namespace marrow::cli {
namespace fs = std::filesystem;
namespace {

std::string mm_or_unknown(double value) {
    return value > 0 ? fmt::format("{:.4g}", value) : "?";
}

// With `is_only`, the reason for a refusal was already printed.
void print_series(std::ostream& out, const SeriesReport& s, bool is_chosen, bool is_only, bool show_patient) {
    const auto line = [&](std::string_view name, const std::string& text) {
        if (!text.empty()) out << fmt::format("  {:<16} {}\n", name, text);
    };
    out << (is_chosen ? "\n* " : "\n  ") << (s.series.id.empty() ? s.series.description : s.series.id)
        << '\n';
    if (!s.series.id.empty()) line("description", s.series.description);
    if (show_patient) line("patient", s.patient_name);
    line("modality", s.series.modality);
    line("samples", fmt::format("{} x {} x {} in {} files", s.series.dims[0], s.series.dims[1],
                                s.series.dims[2], s.series.files));
    line("spacing", fmt::format("{} x {} x {} mm", mm_or_unknown(s.series.spacing[0]),
                                mm_or_unknown(s.series.spacing[1]), mm_or_unknown(s.series.spacing[2])));
    for (std::size_t i = 0; i < s.volumes.size(); ++i)
        line(fmt::format("volume {}", i), s.volumes[i]);
    if (s.tilt > 0) line("gantry tilt", fmt::format("{:.1f} degrees", s.tilt));
    constexpr std::size_t kMostGaps = 5;
    for (std::size_t i = 0; i < std::min(kMostGaps, s.gaps.size()); ++i) line("gap", s.gaps[i]);
    if (s.gaps.size() > kMostGaps) line("gap", fmt::format("{} more", s.gaps.size() - kMostGaps));
    if (s.hounsfield) line("values", *s.hounsfield ? "Hounsfield units" : "not Hounsfield units");
    if (s.smallest_feature)
        line("smallest detail", fmt::format("{:.3g} mm, two samples wide", *s.smallest_feature));
    if (s.memory > 0)
        line("memory", fmt::format("{:.1f} MiB for the samples", static_cast<double>(s.memory) / (1 << 20)));
    for (const std::string& warning : s.warnings) line("warning", apps::name_flags(warning));
    if (!is_only && s.refusal) line("refused", apps::name_flags(*s.refusal));
}

// Inputs without a report are left out.
void print_findings(std::ostream& out, const std::vector<Finding>& findings, bool show_patient) {
    for (const Finding& finding : findings) {
        if (!finding.refusal.empty()) continue;
        const ScanReport& report = finding.report;
        if (findings.size() > 1) out << finding.input.string() << ": ";
        out << fmt::format("{}, {} files, {} series\n", scan_format_name(report.format), report.files,
                           report.series.size());
        for (const std::string& warning : report.warnings)
            out << "warning: " << apps::name_flags(warning) << '\n';
        if (report.chosen)
            out << "the series marked * would be read: " << apps::name_flags(report.reason) << '\n';
        else
            out << "nothing would be read: " << apps::name_flags(report.reason) << '\n';
        for (std::size_t i = 0; i < report.series.size(); ++i)
            print_series(out, report.series[i], report.chosen == i, report.series.size() == 1, show_patient);
    }
}

// Inspects one input. A failure is printed, and sets `code` unless another did before.
Finding inspect(const fs::path& input, const ScanOptions& options, const Console& console, bool json,
                ExitCode& code) {
    Finding finding{input, {}, {}};
    const auto fail = [&](ExitCode failure, const Error& error) {
        finding.refusal = error.what();
        if (code == kOk) code = failure;
        if (!json) console.error(apps::name_flags(finding.refusal));
    };
    try {
        finding.report = inspect_scan(input, options);
    } catch (const Cancelled&) {
        throw;
    } catch (const GeometryError& error) {
        fail(kGeometry, error);
    } catch (const Error& error) {
        fail(kUnreadable, error);
    }
    return finding;
}

}  // namespace

void add_options(Arguments& arguments, InfoCommandOptions& options) {
    arguments.add_inputs("INPUT", options.inputs, kScanHelp);
    add_scan_options(arguments, options.scan);
    add_json_option(arguments, options.reporting);
    arguments.add_flag("--show-patient", options.show_patient, "Print the names of patients.");
}

ExitCode run(const InfoCommandOptions& options, const Console& console, const std::atomic<bool>& stop) {
    ScanOptions scan = options.scan;
    scan.progress = [&](double) { return !stop.load(std::memory_order_relaxed); };
    std::vector<Finding> findings;
    ExitCode code = kOk;
    for (const fs::path& input : options.inputs)
        findings.push_back(inspect(input, scan, console, options.reporting.json, code));
    if (options.reporting.json)
        console.out << findings_json(findings, options.show_patient);
    else
        print_findings(console.out, findings, options.show_patient);
    return code;
}

}  // namespace marrow::cli
