// Prints what is in scans.
#include "info_report.h"

#include <algorithm>
#include <ostream>
#include <string_view>

#include <fmt/format.h>

#include <marrow/printable.h>

#include "shared/library_options.h"
#include "shared/orientation.h"
#include "shared/sample_text.h"
#include "shared/series_summary.h"
#include "steps.h"

namespace marrow::apps {
namespace {

std::string axes_text(const Mat3d& direction, bool stated) {
    return fmt::format("i to {}, j to {}, k to {} ({}{})", direction_name(direction, 0),
                       direction_name(direction, 1), direction_name(direction, 2), plane_name(direction),
                       stated ? "" : "; assumed");
}

// With all digits, so that --crop keeps the slices at the border. Adding 0.0 turns -0 into 0, here and below.
std::string bounds_text(const Geometry& geometry) {
    const Box box = bounds(geometry);
    return fmt::format("{},{},{},{},{},{} mm in LPS, as for --crop", box.lower[0] + 0.0, box.upper[0] + 0.0,
                       box.lower[1] + 0.0, box.upper[1] + 0.0, box.lower[2] + 0.0, box.upper[2] + 0.0);
}

std::string unit_text(const SeriesReport& s, const SampleReport* samples) {
    if (!s.series.labels.empty() || (samples != nullptr && !samples->labels.empty())) return "labels";
    if (s.hounsfield) return *s.hounsfield ? "Hounsfield units" : "not Hounsfield units";
    if (samples == nullptr) return "";
    return samples->may_be_hounsfield
               ? "probably Hounsfield units, as the lowest looks like air; the format does not say"
               : "not Hounsfield units, as the lowest is not air";
}

std::string values_text(const SeriesReport& s, const SampleReport* samples) {
    const std::string unit = unit_text(s, samples);
    if (samples == nullptr) return unit;
    if (samples->finite == 0)
        return fmt::format("{}, none finite", sample_text(samples->type, samples->rescale));
    return fmt::format("{} from {} to {}, {}", sample_text(samples->type, samples->rescale),
                       value_text(samples->lower), value_text(samples->upper), unit);
}

std::string labels_text(const std::vector<SampleReport::Label>& labels) {
    constexpr std::size_t kMost = 10;
    std::string text;
    std::size_t listed = 0;
    for (const auto& [label, samples, name] : labels) {
        if (++listed > kMost) return text + fmt::format(", and {} more", labels.size() - kMost);
        text += fmt::format("{}{}{} ({})", text.empty() ? "" : ", ", label, name ? ' ' + *name : "",
                            count_of(samples, "sample"));
    }
    return text;
}

// One line, to tell a series from others.
std::string summary(const SeriesReport& s) {
    return printable(series_summary(s) + (s.refusal ? ", refused: " + name_flags(*s.refusal) : ""));
}

// With `is_only`, the reason for a refusal was already printed.
void print_details(std::ostream& out, ScanFormat format, const SeriesReport& s, const SampleReport* samples,
                   bool is_only, bool show_patient) {
    const auto line = [&](std::string_view name, const std::string& text) {
        if (!text.empty()) out << fmt::format("  {:<16} {}\n", name, printable(text));
    };
    out << '\n';
    line("series", s.series.id);
    line(format == ScanFormat::dicom ? "description" : "file", s.series.description);
    if (show_patient) line("patient", s.patient_name);
    if (s.number) line("series number", std::to_string(*s.number));
    line("modality", s.series.modality);
    line("image type", s.image_type);
    if (s.echo_time && s.volumes.empty()) line("echo time", fmt::format("{:g} ms", *s.echo_time));
    line("kernel", s.kernel);
    line("samples", fmt::format("{} x {} x {} in {}", s.series.dims[0], s.series.dims[1], s.series.dims[2],
                                count_of(s.series.files, "file")));
    line("spacing", spacing_text(s.series.spacing));
    if (s.geometry) {
        const Vec3d& origin = s.geometry->origin;
        line("axes", axes_text(s.geometry->direction, s.oriented));
        line("origin",
             fmt::format("{:g},{:g},{:g} mm in LPS", origin[0] + 0.0, origin[1] + 0.0, origin[2] + 0.0));
        line("bounds", bounds_text(*s.geometry));
    }
    for (std::size_t i = 0; i < s.volumes.size(); ++i) line(fmt::format("volume {}", i), s.volumes[i]);
    for (std::size_t i = 0; i < s.levels.size() && s.levels.size() > 1; ++i) {
        const auto& [nx, ny, nz] = s.levels[i];
        line(fmt::format("level {}", i), fmt::format("{} x {} x {}", nx, ny, nz));
    }
    if (s.tilt > 0) line("gantry tilt", fmt::format("{:.1f} degrees", s.tilt));
    constexpr std::size_t kMostGaps = 5;
    for (std::size_t i = 0; i < std::min(kMostGaps, s.gaps.size()); ++i) line("gap", s.gaps[i]);
    if (s.gaps.size() > kMostGaps) line("gap", fmt::format("{} more", s.gaps.size() - kMostGaps));
    line("values", values_text(s, samples));
    if (samples != nullptr) line("labels", labels_text(samples->labels));
    line("not stated", fmt::format("{}", fmt::join(unknown_facts(s), ", ")));
    if (s.smallest_feature)
        line("smallest detail", fmt::format("{:.3g} mm, two samples wide", *s.smallest_feature));
    if (s.memory > 0)
        line("memory",
             s.memory < 1 << 20
                 ? fmt::format("{:.1f} KiB for the samples", static_cast<double>(s.memory) / (1 << 10))
                 : fmt::format("{:.1f} MiB for the samples", static_cast<double>(s.memory) / (1 << 20)));
    for (const std::string& warning : s.warnings) line("warning", name_flags(warning));
    if (!is_only && s.refusal) line("refused", name_flags(*s.refusal));
}

}  // namespace

void print_finding(std::ostream& out, const Finding& finding, bool show_patient) {
    const ScanReport& report = *finding.report;
    const std::size_t count = report.series.size();
    out << fmt::format("{}, {}, {}\n", scan_format_name(report.format), count_of(report.files, "file"),
                       count_of(count, "series"));
    for (const std::string& warning : report.warnings)
        out << "warning: " << printable(name_flags(warning)) << '\n';
    if (!report.chosen)
        out << "nothing would be read: " << printable(name_flags(report.reason)) << '\n';
    else if (count > 1)
        out << "the series marked * would be read: " << printable(name_flags(report.reason)) << '\n';
    for (std::size_t i = 0; count > 1 && i < count; ++i)
        out << fmt::format("{}{:>3}  {}\n", report.chosen == i ? '*' : ' ', i + 1, summary(report.series[i]));
    if (count == 1 || report.chosen)
        print_details(out, report.format, report.series[report.chosen.value_or(0)],
                      finding.samples ? &*finding.samples : nullptr, count == 1, show_patient);
}

}  // namespace marrow::apps
