// Checks meshes and prints what was found.
#include "check.h"

#include <cmath>
#include <ostream>

#include <fmt/format.h>

#include <marrow/mesh_check.h>
#include <marrow/mesh_io.h>
#include <marrow/printable.h>

#include "json_report.h"
#include "progress_reporter.h"
#include "shared/decimal_text.h"
#include "shared/report_progress.h"

namespace marrow::apps {
namespace fs = std::filesystem;
namespace {

// A number for people to read, with at most 15 digits.
std::string plain(double number) {
    return std::abs(number) < 1e12 ? decimal_text(number, 2) : fmt::format("{:.6g}", number);
}

// Cavities lie in pieces. Where there is no piece, the surface is inside out.
std::string pieces_text(std::int64_t pieces, std::int64_t cavities) {
    if (pieces == 0 && cavities > 0) return fmt::format("{}, inside out", cavities);
    return fmt::format("{}, with {} {}", pieces, cavities, cavities == 1 ? "cavity" : "cavities");
}

// Why a mesh is not oriented.
std::string misorientation_text(const MeshCheck& c) {
    if (c.misoriented_edges > 0) return fmt::format("{} edges", c.misoriented_edges);
    if (c.inverted_components == 0 || c.inverted_components == c.measures.components)
        return "the surface faces inward";
    return fmt::format("{} of {} components face inward, but are not cavities", c.inverted_components,
                       c.measures.components);
}

// Sound or not, and how thin it is.
std::string verdict(const MeshCheck& c, double min_wall) {
    std::string text = c.is_sound() ? "sound" : "NOT sound";
    if (c.thin_triangles > 0) text += fmt::format(", with walls below {:g} mm", min_wall);
    return text;
}

class Printer {
  public:
    Printer(std::ostream& out, double min_wall, Space space)
        : out_(out), min_wall_(min_wall), space_(space) {}

    // The lines of one mesh below its name.
    void print(const CheckedObject& object, int indent) const {
        const MeshCheck& c = object.found;
        const MeshMeasures& m = c.measures;
        const auto line = [&](const char* name, const std::string& text) {
            out_ << fmt::format("{:{}}{:<20} {}\n", "", indent, name, text);
        };
        const auto yes_or = [](bool yes, const std::string& no) {
            return yes ? std::string("yes") : "no: " + no;
        };
        line("closed",
             yes_or(c.is_closed(), m.triangles == 0 ? "there are no triangles"
                                                    : fmt::format("{} open edges", m.boundary_edges)));
        line("manifold", yes_or(c.is_manifold(),
                                fmt::format("{} edges, {} points", m.nonmanifold_edges - c.misoriented_edges,
                                            c.nonmanifold_points)));
        line("oriented", yes_or(c.is_oriented(), misorientation_text(c)));
        line("self-intersections", std::to_string(c.self_intersections));
        line("degenerate triangles", std::to_string(c.degenerate_triangles));
        if (min_wall_ > 0)
            line("thin walls",
                 c.thin_triangles == 0
                     ? fmt::format("none below {:g} mm", min_wall_)
                     : fmt::format("{} mm2 ({:.2f} %) below {:g} mm; thinnest {:.3g} mm", plain(c.thin_area),
                                   100 * c.thin_area / m.area, min_wall_, *c.thinnest_wall));
        line("pieces", pieces_text(m.components - c.cavities, c.cavities));
        line("Euler characteristic", c.genus ? fmt::format("{}; genus {}", m.euler_characteristic, *c.genus)
                                             : std::to_string(m.euler_characteristic));
        line("points, triangles", fmt::format("{}, {}", m.points, m.triangles));
        line("area, volume",
             fmt::format("{} mm2, {}", plain(m.area),
                         object.has_volume() ? plain(m.volume) + " mm3"
                         : c.is_closed()     ? "- (a mesh whose triangles face both ways has no volume)"
                                             : "- (an open mesh has no volume)"));
        line("bounds", fmt::format("{:g} {:g} {:g} to {:g} {:g} {:g} mm ({})", m.lower[0], m.lower[1],
                                   m.lower[2], m.upper[0], m.upper[1], m.upper[2],
                                   space_ != Space::none ? "LPS" : "the file does not state its space"));
    }

    // One line for an object that is sound and thick enough, and all lines for another.
    void print_several(const CheckedFile& file) const {
        for (const CheckedObject& object : file.objects) {
            const MeshCheck& c = object.found;
            out_ << fmt::format("  {}: {}", printable(object.name), verdict(c, min_wall_));
            if (!c.is_sound() || c.thin_triangles > 0) {
                out_ << '\n';
                print(object, 4);
            } else {
                out_ << fmt::format("; {} triangles, {} mm2, {} mm3\n", c.measures.triangles,
                                    plain(c.measures.area), plain(c.measures.volume));
            }
        }
        for (const MeshCrossing& crossing : file.crossings)
            out_ << fmt::format("  {} and {} pass through each other at {} pairs of triangles\n",
                                printable(file.objects[crossing.first].name),
                                printable(file.objects[crossing.second].name), crossing.pairs);
    }

  private:
    std::ostream& out_;
    const double min_wall_;
    const Space space_;
};

void print(std::ostream& out, const CheckedFile& file, double min_wall) {
    const Printer printer(out, min_wall, file.space);
    out << printable(file.file.string()) << ": ";
    if (file.objects.size() == 1) {
        out << verdict(file.objects.front().found, min_wall) << '\n';
        printer.print(file.objects.front(), 2);
    } else {
        out << fmt::format("{}{}, {} objects\n", file.is_sound() ? "sound" : "NOT sound",
                           file.has_thin_walls() ? fmt::format(", with walls below {:g} mm", min_wall) : "",
                           file.objects.size());
        printer.print_several(file);
    }
}

CheckedFile check_file(const fs::path& path, const CheckCommandOptions& wanted,
                       const ProgressReporter& reporter) {
    CheckedFile file{path, {}, {}, {}, {}};
    try {
        reporter.stage("check", [&](const Progress& progress) {
            constexpr double kReading = 0.2;  // of the time
            std::vector<NamedMesh> meshes = read_meshes(path, &file.space, share_of(progress, 0, kReading));
            const Progress checking = share_of(progress, kReading, 1);
            CheckOptions options;
            options.threads = wanted.threads;
            if (wanted.min_wall > 0) options.min_wall = wanted.min_wall;
            const double steps = meshes.size() == 1 ? 1 : 2 * static_cast<double>(meshes.size());
            std::vector<MeshView> views;
            for (NamedMesh& named : meshes) {
                const auto step = static_cast<double>(views.size());
                options.progress = share_of(checking, step / steps, (step + 1) / steps);
                file.objects.push_back({std::move(named.name), check_mesh(named.mesh, options)});
                views.push_back(named.mesh);
                if (file.objects.back().name.empty())
                    file.objects.back().name = fmt::format("object {}", file.objects.size());
            }
            options.progress = share_of(checking, 0.5, 1);
            if (meshes.size() > 1) file.crossings = find_crossings(views, options);
        });
    } catch (const Cancelled&) {
        throw;
    } catch (const Error& error) {
        file.objects.clear();
        file.failure = Failure{error.what(), exit_code_of(error)};
    }
    if (wanted.strict && !file.is_sound())
        file.failure = Failure{fmt::format("'{}' is not sound", path.string()), kCheckFailed};
    else if (wanted.strict && file.has_thin_walls())
        file.failure = Failure{
            fmt::format("'{}' has walls thinner than {:g} mm", path.string(), wanted.min_wall), kCheckFailed};
    if (file.failure) reporter.console().error(file.failure->error);
    return file;
}

}  // namespace

void add_options(Arguments& arguments, CheckCommandOptions& options) {
    arguments.add_inputs("MESH", options.inputs,
                         ".stl, .ply, .obj (also .gz), .vtp, .3mf or .dcm, in mm; .glb, in metres");
    arguments.start_group("Checks");
    arguments.add_option(
        "--min-wall",
        number_value("MM", "a thickness in mm, 0 or more", options.min_wall, [](double x) { return x >= 0; }),
        "Find walls thinner than MM.");
    arguments.add_flag("--strict", options.strict,
                       "Exit with 6 if a mesh is not sound, or has walls thinner than --min-wall.");
    add_threads_option(arguments, options.threads);
    add_json_option(arguments, options.reporting);
    add_quiet_option(arguments, options.reporting);
}

ExitCode run(const CheckCommandOptions& options, const Console& console, const std::atomic<bool>& stop) {
    const ProgressReporter reporter(options.reporting, console, stop);
    std::vector<CheckedFile> files;
    for (const fs::path& input : options.inputs) {
        const CheckedFile& file = files.emplace_back(check_file(input, options, reporter));
        const bool prints = !options.reporting.json && !options.reporting.quiet;
        if (prints && !file.objects.empty()) print(console.out, file, options.min_wall);
    }
    if (options.reporting.json) console.out << checks_json(files, options.min_wall);
    const Failure* failure = decisive_failure(files);
    return failure ? failure->exit_code : kOk;
}

}  // namespace marrow::apps
