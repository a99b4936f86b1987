// Prints extracted surfaces as text or JSON.
#include "report.h"

#include <algorithm>
#include <ostream>
#include <string_view>

#include <fmt/format.h>

#include <marrow/printable.h>

#include "json_report.h"
#include "shared/sample_text.h"
#include "trust_steps.h"

namespace marrow::apps {
namespace {

std::string source_of(const Surface& surface) {
    if (!surface.label) return fmt::format("at isovalue {}", value_text(surface.isovalue));
    return fmt::format("of label {}, {}: {:.6g} mm3, {:+.1f} % of its samples", *surface.label,
                       printable(surface.name), surface.label_volume.enclosed_mm3,
                       surface.label_volume.change());
}

}  // namespace

void print_text(std::ostream& out, const SurfaceResults& results) {
    for (const Surface& surface : results.surfaces) {
        out << fmt::format("{}: {} points, {} triangles {}{}\n",
                           printable(surface.output.empty() ? surface.name : surface.output.string()),
                           surface.size().points, surface.size().triangles, source_of(surface),
                           surface.device == kCpu ? "" : ", on " + surface.device);
        if (surface.held_back > 0)
            out << fmt::format(
                "  relaxation: held back at {} points to keep surfaces from passing through each other\n",
                surface.held_back);
        out << trust_lines(surface);
        for (const StepReport& step : surface.steps) {
            out << fmt::format("  {:<12}{} of {} triangles", step.name + ":", step.after.triangles,
                               step.before.triangles);
            const auto print_change = [&](const char* name, double before, double after) {
                if (before != 0) out << fmt::format(", {} {:+.3f} %", name, 100 * (after / before - 1));
            };
            if (step.encloses_volume) print_change("volume", step.before.size.volume, step.after.size.volume);
            print_change("area", step.before.size.area, step.after.size.area);
            if (const auto& moved = step.deviation ? step.deviation : step.moved)
                out << fmt::format(", moved {:.3g} mm at most and {:.3g} mm on average", moved->max,
                                   moved->mean);
            if (step.held_back > 0 && step.deviation)
                out << fmt::format(", {} collapses undone to keep the surface valid or close enough",
                                   step.held_back);
            else if (step.held_back > 0)
                out << fmt::format(", held back at {} points to keep the surface from passing through itself",
                                   step.held_back);
            out << '\n';
        }
    }
    if (results.verified)
        out << fmt::format("verified: all {} triangles are in the files as extracted\n", *results.verified);
}

void print_results(const ProgressReporter& reporter, const SurfaceResults& results, Space space) {
    std::ostream& out = reporter.console().out;
    if (reporter.reporting().json)
        out << surfaces_json(results, space);
    else if (!reporter.reporting().quiet)
        print_text(out, results);
}

std::function<void(const std::string&, ExitCode)> error_printer(int argc, const char* const* argv,
                                                                std::ostream& out) {
    const auto is_json = [](std::string_view argument) { return argument == "--json"; };
    if (std::none_of(argv, argv + argc, is_json)) return {};
    return [&out](const std::string& message, ExitCode code) { out << error_json(message, code); };
}

}  // namespace marrow::apps
