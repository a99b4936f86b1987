#include <algorithm>
#include <ostream>

#include <sys/resource.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "report.h"

namespace marrow {
namespace {

using Json = nlohmann::ordered_json;

// The smallest box in the space that is written; RAS swaps the ends of x and y.
Json bounds(const MeshMeasures& m, Space space) {
    if (space == Space::LPS) return {m.lower, m.upper};
    return {Vec3f{-m.upper[0], -m.upper[1], m.lower[2]}, Vec3f{-m.lower[0], -m.lower[1], m.upper[2]}};
}

Json text_or_null(const std::string& text) {
    return text.empty() ? Json() : Json(text);
}

Json step_numbers(const StepReport& step) {
    const auto pair = [](auto before, auto after) { return Json{before, after}; };
    return {{"step", step.name},
            {"triangles", pair(step.before.triangles, step.after.triangles)},
            {"components", pair(step.before.components, step.after.components)},
            {"boundary_edges", pair(step.before.boundary_edges, step.after.boundary_edges)},
            {"nonmanifold_edges", pair(step.before.nonmanifold_edges, step.after.nonmanifold_edges)},
            {"volume_mm3", pair(step.before.volume, step.after.volume)},
            {"area_mm2", pair(step.before.area, step.after.area)},
            {"deviation_mm",
             step.deviation ? Json{{"max", step.deviation->max}, {"mean", step.deviation->mean}} : Json()}};
}

Json surface_numbers(const Surface& surface, Space space) {
    const auto [points, triangles] = surface.size();
    Json numbers;
    if (surface.label)
        numbers.update({{"label", *surface.label},
                        {"samples", surface.label_volume.samples},
                        {"samples_mm3", surface.label_volume.samples_mm3}});
    else
        numbers["isovalue"] = surface.isovalue;
    numbers.update({{"points", points}, {"triangles", triangles}});
    if (surface.in_slabs) {  // what takes the whole surface is not known
        for (const char* name : {"components", "boundary_edges", "nonmanifold_edges", "euler_characteristic",
                                 "area_mm2", "volume_mm3", "bounds_mm", "steps"})
            numbers[name] = Json();
        return numbers;
    }
    const MeshMeasures m = measure(surface.mesh);
    numbers.update({{"components", m.components},
                    {"boundary_edges", m.boundary_edges},
                    {"nonmanifold_edges", m.nonmanifold_edges},
                    {"euler_characteristic", m.euler_characteristic},
                    {"area_mm2", m.area},
                    {"volume_mm3", m.volume},
                    {"bounds_mm", bounds(m, space)}});
    numbers["steps"] = Json::array();
    for (const StepReport& step : surface.steps) numbers["steps"].push_back(step_numbers(step));
    return numbers;
}

std::int64_t peak_memory_bytes() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return std::int64_t{usage.ru_maxrss} * 1024;
}

// File and series names may hold bytes that are not UTF-8.
void print(std::ostream& out, const Json& json) {
    out << json.dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
}

}  // namespace

void print_json(std::ostream& out, const ScanInfo& info, const std::vector<Surface>& surfaces, Space space,
                const std::vector<std::string>& warnings, const StageSeconds& seconds) {
    Json json;
    json["input"] = {{"format", scan_format_name(info.format)},
                     {"modality", text_or_null(info.series.modality)},
                     {"dims", info.series.dims},
                     {"spacing_mm", info.series.spacing},
                     {"series", text_or_null(info.series.id)}};
    if (surfaces.size() == 1 && !surfaces.front().label) {
        json.update(surface_numbers(surfaces.front(), space));
    } else {
        for (const Surface& surface : surfaces) {
            Json numbers{{"name", surface.name}};
            numbers.update(surface_numbers(surface, space));
            numbers["output"] = text_or_null(surface.output.string());
            json["surfaces"].push_back(numbers);
        }
    }
    json["warnings"] = warnings;
    json["seconds"] = {{"read", seconds.read},     {"filter", seconds.filter}, {"extract", seconds.extract},
                       {"refine", seconds.refine}, {"write", seconds.write},   {"verify", seconds.verify},
                       {"total", seconds.total}};
    json["peak_memory_bytes"] = peak_memory_bytes();
    if (surfaces.size() == 1 && !surfaces.front().label)
        json["output"] = text_or_null(surfaces.front().output.string());
    print(out, json);
}

namespace {

std::string what_it_is_of(const Surface& surface) {
    if (!surface.label) return fmt::format("at isovalue {:g}", surface.isovalue);
    return fmt::format("of label {}, {}: {:.6g} mm3, {:+.1f} % of its samples", *surface.label, surface.name,
                       surface.label_volume.enclosed_mm3, surface.label_volume.change());
}

}  // namespace

void print_text(std::ostream& out, const std::vector<Surface>& surfaces) {
    for (const Surface& surface : surfaces) {
        out << fmt::format("{}: {} points, {} triangles {}\n",
                           surface.output.empty() ? surface.name : surface.output.string(),
                           surface.size().points, surface.size().triangles, what_it_is_of(surface));
        for (const StepReport& step : surface.steps) {
            const auto change = [](double before, double after) { return 100 * (after / before - 1); };
            out << fmt::format("  {:<12}{} of {} triangles, volume {:+.3f} %, area {:+.3f} %",
                               step.name + ":", step.after.triangles, step.before.triangles,
                               change(step.before.volume, step.after.volume),
                               change(step.before.area, step.after.area));
            if (step.deviation)
                out << fmt::format(", moved {:.3g} mm at most and {:.3g} mm on average", step.deviation->max,
                                   step.deviation->mean);
            out << '\n';
        }
    }
}

namespace {

Json number_or_null(double value) {
    return value > 0 ? Json(value) : Json();
}

Json finding_json(const Finding& finding, bool show_patient) {
    Json json{{"input", finding.input.string()}};
    if (!finding.refusal.empty()) {
        json["refused"] = finding.refusal;
        return json;
    }
    const ScanReport& report = finding.report;
    json["refused"] = report.chosen ? Json() : Json(report.reason);
    json["format"] = scan_format_name(report.format);
    json["files"] = report.files;
    json["chosen"] = report.chosen ? Json(*report.chosen) : Json();
    json["reason"] = report.chosen ? Json(report.reason) : Json();
    json["warnings"] = report.warnings;
    json["series"] = Json::array();
    for (const SeriesReport& s : report.series) {
        const Vec3d& spacing = s.series.spacing;
        Json one{{"series", text_or_null(s.series.id)},
                 {"description", text_or_null(s.series.description)},
                 {"modality", text_or_null(s.series.modality)},
                 {"dims", s.series.dims},
                 {"spacing_mm",
                  {number_or_null(spacing[0]), number_or_null(spacing[1]), number_or_null(spacing[2])}},
                 {"files", s.series.files},
                 {"tilt_degrees", s.tilt},
                 {"gaps", s.gaps},
                 {"hounsfield_units", s.hounsfield ? Json(*s.hounsfield) : Json()},
                 {"smallest_feature_mm", s.smallest_feature ? Json(*s.smallest_feature) : Json()},
                 {"memory_bytes", s.memory},
                 {"warnings", s.warnings},
                 {"refused", s.refusal ? Json(*s.refusal) : Json()}};
        if (show_patient) one["patient"] = text_or_null(s.patient_name);
        json["series"].push_back(std::move(one));
    }
    return json;
}

std::string shown_mm(double value) {
    return value > 0 ? fmt::format("{:.4g}", value) : "?";
}

// `is_only`: why it is refused has been said.
void print_one(std::ostream& out, const SeriesReport& s, bool is_chosen, bool is_only, bool show_patient) {
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
    line("spacing", fmt::format("{} x {} x {} mm", shown_mm(s.series.spacing[0]),
                                shown_mm(s.series.spacing[1]), shown_mm(s.series.spacing[2])));
    if (s.tilt > 0) line("gantry tilt", fmt::format("{:.1f} degrees", s.tilt));
    constexpr std::size_t most_gaps = 5;
    for (std::size_t i = 0; i < std::min(most_gaps, s.gaps.size()); ++i) line("gap", s.gaps[i]);
    if (s.gaps.size() > most_gaps) line("gap", fmt::format("{} more", s.gaps.size() - most_gaps));
    if (s.hounsfield) line("values", *s.hounsfield ? "Hounsfield units" : "not Hounsfield units");
    if (s.smallest_feature)
        line("smallest detail", fmt::format("{:.3g} mm, two samples wide", *s.smallest_feature));
    if (s.memory > 0)
        line("memory", fmt::format("{:.1f} MiB for the samples", static_cast<double>(s.memory) / (1 << 20)));
    for (const std::string& warning : s.warnings) line("warning", warning);
    if (!is_only) line("refused", s.refusal.value_or(""));
}

}  // namespace

void print_findings(std::ostream& out, const std::vector<Finding>& findings, bool show_patient) {
    for (const Finding& finding : findings) {
        if (!finding.refusal.empty()) continue;
        const ScanReport& report = finding.report;
        if (findings.size() > 1) out << finding.input.string() << ": ";
        out << fmt::format("{}, {} files, {} series\n", scan_format_name(report.format), report.files, report.series.size());
        for (const std::string& warning : report.warnings) out << "warning: " << warning << '\n';
        if (report.chosen)
            out << "the series marked * would be read: " << report.reason << '\n';
        else
            out << "nothing would be read: " << report.reason << '\n';
        for (std::size_t i = 0; i < report.series.size(); ++i)
            print_one(out, report.series[i], report.chosen == i, report.series.size() == 1, show_patient);
    }
}

void print_findings_json(std::ostream& out, const std::vector<Finding>& findings, bool show_patient) {
    if (findings.size() == 1) return print(out, finding_json(findings.front(), show_patient));
    Json inputs = Json::array();
    for (const Finding& finding : findings) inputs.push_back(finding_json(finding, show_patient));
    print(out, {{"inputs", std::move(inputs)}});
}

}  // namespace marrow
