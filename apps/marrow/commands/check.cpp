// Checks meshes and prints what was found.
#include "check.h"

#include <cmath>
#include <ostream>

#include <fmt/format.h>

#include <marrow/mesh_check.h>
#include <marrow/mesh_io.h>

#include "json_report.h"
#include "progress_reporter.h"

namespace marrow::cli {
namespace fs = std::filesystem;
namespace {

// A number for people to read, with at most 15 digits.
std::string plain(double number) {
    return std::abs(number) < 1e12 ? fmt::format("{:.2f}", number) : fmt::format("{:.6g}", number);
}

// Cavities lie in pieces. Where there is no piece, the surface is inside out.
std::string pieces_text(std::int64_t pieces, std::int64_t cavities) {
    if (pieces == 0 && cavities > 0) return fmt::format("{}, inside out", cavities);
    return fmt::format("{}, with {} {}", pieces, cavities, cavities == 1 ? "cavity" : "cavities");
}

void print(std::ostream& out, const CheckedMesh& checked, double min_wall) {
    const MeshCheck& c = checked.found;
    const MeshMeasures& m = c.measures;
    const auto line = [&](const char* name, const std::string& text) {
        out << fmt::format("  {:<20} {}\n", name, text);
    };
    const auto yes_or = [](bool yes, const std::string& no) {
        return yes ? std::string("yes") : "no: " + no;
    };
    out << fmt::format("{}: {}\n", checked.file.string(), c.is_sound() ? "sound" : "NOT sound");
    line("closed", yes_or(c.is_closed(), m.triangles == 0 ? "there are no triangles"
                                                          : fmt::format("{} open edges", m.boundary_edges)));
    line("manifold",
         yes_or(c.is_manifold(), fmt::format("{} edges, {} points", m.nonmanifold_edges - c.misoriented_edges,
                                             c.nonmanifold_points)));
    line("oriented",
         yes_or(c.is_oriented(), c.misoriented_edges > 0 ? fmt::format("{} edges", c.misoriented_edges)
                                                         : std::string("the surface faces inward")));
    line("self-intersections", std::to_string(c.self_intersections));
    line("degenerate triangles", std::to_string(c.degenerate_triangles));
    if (min_wall > 0)
        line("thin walls",
             c.thin_triangles == 0
                 ? fmt::format("none below {:g} mm", min_wall)
                 : fmt::format("{} mm2 ({:.2f} %) below {:g} mm; thinnest {:.3g} mm", plain(c.thin_area),
                               100 * c.thin_area / m.area, min_wall, *c.thinnest_wall));
    line("pieces", pieces_text(m.components - c.cavities, c.cavities));
    line("Euler characteristic", c.genus ? fmt::format("{}; genus {}", m.euler_characteristic, *c.genus)
                                         : std::to_string(m.euler_characteristic));
    line("points, triangles", fmt::format("{}, {}", m.points, m.triangles));
    line("area, volume",
         fmt::format("{} mm2, {}", plain(m.area),
                     checked.has_volume() ? plain(m.volume) + " mm3"
                     : c.is_closed()      ? "- (a mesh whose triangles face both ways has no volume)"
                                          : "- (an open mesh has no volume)"));
    line("bounds", fmt::format("{:g} {:g} {:g} to {:g} {:g} {:g} mm ({})", m.lower[0], m.lower[1], m.lower[2],
                               m.upper[0], m.upper[1], m.upper[2],
                               checked.space != Space::none ? "LPS" : "the file does not state its space"));
}

CheckedMesh check_file(const fs::path& file, const CheckCommandOptions& wanted,
                       const ProgressReporter& reporter) {
    CheckedMesh checked{file, {}, {}, {}};
    try {
        reporter.stage("check", [&](const Progress& progress) {
            const Mesh mesh = read_mesh(file, &checked.space);
            CheckOptions options;
            options.threads = wanted.threads;
            options.progress = progress;
            if (wanted.min_wall > 0) options.min_wall = wanted.min_wall;
            checked.found = check_mesh(mesh, options);
        });
    } catch (const Cancelled&) {
        throw;
    } catch (const Error& error) {
        checked.refusal = error.what();
        reporter.console().error(checked.refusal);
    }
    return checked;
}

}  // namespace

void add_options(Arguments& arguments, CheckCommandOptions& options) {
    arguments.add_inputs("MESH", options.inputs,
                         ".stl, .ply, .obj (also .gz), .vtp, .3mf or .dcm, in mm; .glb, in metres");
    arguments.add_option(
        "--min-wall",
        number_value("MM", "a thickness in mm", options.min_wall, [](double x) { return x >= 0; }),
        "Find walls thinner than MM.");
    arguments.add_flag("--strict", options.strict, "Exit with 6 if a mesh is not sound.");
    add_threads_option(arguments, options.threads);
    add_json_option(arguments, options.reporting);
    add_quiet_option(arguments, options.reporting);
}

ExitCode run(const CheckCommandOptions& options, const Console& console, const std::atomic<bool>& stop) {
    const ProgressReporter reporter(options.reporting, console, stop);
    std::vector<CheckedMesh> meshes;
    bool readable = true, sound = true;
    for (const fs::path& file : options.inputs) {
        const CheckedMesh& checked = meshes.emplace_back(check_file(file, options, reporter));
        readable = readable && checked.refusal.empty();
        sound = sound && (!checked.refusal.empty() || checked.found.is_sound());
        if (!options.reporting.json && !options.reporting.quiet && checked.refusal.empty())
            print(console.out, checked, options.min_wall);
    }
    if (options.reporting.json) console.out << checks_json(meshes, options.min_wall);
    if (!readable) return kUnreadable;
    return options.strict && !sound ? kCheckFailed : kOk;
}

}  // namespace marrow::cli
