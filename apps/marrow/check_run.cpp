#include "check_run.h"

#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <marrow/mesh_check.h>
#include <marrow/measure.h>
#include <marrow/mesh_io.h>

namespace marrow {
namespace fs = std::filesystem;
namespace {

using Json = nlohmann::ordered_json;

struct Checked {
    fs::path file;
    Space space = Space::none;
    MeshCheck found;
    std::string refusal;  // why nothing was found; empty: something was

    // Only what has no open edge, and faces one way all over, encloses something.
    bool has_volume() const {
        return found.is_closed() && found.measures.nonmanifold_edges == 0 && found.misoriented_edges == 0;
    }
};

// Numbers that people read: not more than 15 digits.
std::string plain(double number) {
    return std::abs(number) < 1e12 ? fmt::format("{:.2f}", number) : fmt::format("{:.6g}", number);
}

Json to_json(const Checked& checked, double min_wall) {
    if (!checked.refusal.empty()) return {{"mesh", checked.file.string()}, {"error", checked.refusal}};
    const MeshCheck& c = checked.found;
    const MeshMeasures& m = c.measures;
    Json json{{"mesh", checked.file.string()},
              {"space", checked.space != Space::none ? Json(checked.space == Space::RAS ? "RAS" : "LPS") : Json()},
              {"sound", c.is_sound()},
              {"closed", c.is_closed()},
              {"manifold", c.is_manifold()},
              {"oriented", c.is_oriented()},
              {"points", m.points},
              {"triangles", m.triangles},
              {"components", m.components},
              {"cavities", c.cavities},
              {"euler_characteristic", m.euler_characteristic},
              {"genus", c.genus ? Json(*c.genus) : Json()},
              {"boundary_edges", m.boundary_edges},
              {"nonmanifold_edges", m.nonmanifold_edges - c.misoriented_edges},
              {"misoriented_edges", c.misoriented_edges},
              {"nonmanifold_points", c.nonmanifold_points},
              {"unused_points", c.unused_points},
              {"degenerate_triangles", c.degenerate_triangles},
              {"self_intersections", c.self_intersections},
              {"area_mm2", m.area},
              {"volume_mm3", checked.has_volume() ? Json(m.volume) : Json()},
              {"bounds_mm", {m.lower, m.upper}}};
    if (min_wall > 0)
        json["thin_walls"] = {{"below_mm", min_wall},
                              {"triangles", c.thin_triangles},
                              {"area_mm2", c.thin_area},
                              {"thinnest_mm", c.thin_triangles ? Json(c.thinnest_wall) : Json()}};
    return json;
}

void print(std::ostream& out, const Checked& checked, double min_wall) {
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
                                                         : std::string("the whole faces inward")));
    line("self-intersections", std::to_string(c.self_intersections));
    line("degenerate triangles", std::to_string(c.degenerate_triangles));
    if (min_wall > 0)
        line("thin walls",
             c.thin_triangles == 0
                 ? fmt::format("none below {:g} mm", min_wall)
                 : fmt::format("{} mm2 ({:.2f} %) below {:g} mm; thinnest {:.3g} mm", plain(c.thin_area),
                               100 * c.thin_area / m.area, min_wall, c.thinnest_wall));
    line("components", fmt::format("{}, of which {} cavities", m.components, c.cavities));
    line("Euler characteristic", c.genus ? fmt::format("{}; genus {}", m.euler_characteristic, *c.genus)
                                         : std::to_string(m.euler_characteristic));
    line("points, triangles", fmt::format("{}, {}", m.points, m.triangles));
    line("area, volume",
         fmt::format("{} mm2, {}", plain(m.area),
                     checked.has_volume() ? plain(m.volume) + " mm3"
                     : c.is_closed()      ? "- (a mesh of triangles that face both ways has no volume)"
                                          : "- (an open mesh has no volume)"));
    line("bounds", fmt::format("{:g} {:g} {:g} to {:g} {:g} {:g} mm ({})", m.lower[0], m.lower[1], m.lower[2],
                               m.upper[0], m.upper[1], m.upper[2],
                               checked.space != Space::none ? "LPS" : "the file does not say which space"));
}

}  // namespace

// A mesh that cannot be read does not hide the others.
ExitCode check(const Settings& settings, const Console& console, Voice& voice) {
    Json meshes = Json::array();
    bool sound = true;
    ExitCode code = kOk;
    for (const fs::path& file : settings.inputs) {
        Checked checked{file, {}, {}, {}};
        try {
            voice.stage("check", [&](const Progress& progress) {
                const Mesh mesh = read_mesh(file, &checked.space);
                checked.found = check_mesh(mesh, {settings.min_wall, progress});
            });
            sound = sound && checked.found.is_sound();
        } catch (const Cancelled&) {
            throw;
        } catch (const Error& error) {
            checked.refusal = error.what();
            code = kUnreadable;
            console.err << "marrow: " << checked.refusal << '\n';
        }
        if (settings.json)
            meshes.push_back(to_json(checked, settings.min_wall));
        else if (!settings.quiet && checked.refusal.empty())
            print(console.out, checked, settings.min_wall);
    }
    if (settings.json) {
        const Json json = meshes.size() == 1 ? meshes[0] : Json{{"meshes", meshes}};
        console.out << json.dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
    }
    if (code != kOk) return code;
    return settings.strict && !sound ? kCheckFailed : kOk;
}

void verify(std::span<const MeshObject> objects, const fs::path& file, Space space) {
    const auto fail = [&](const std::string& why) {
        throw CheckFailed(fmt::format("'{}' is not what was written: {}", file.string(), why));
    };
    Space stated = Space::none;
    const Mesh found = read_mesh(file, &stated);
    if (stated != space) fail("it states another space");
    std::size_t points = 0, triangles = 0;
    for (const MeshObject& object : objects) {
        points += object.mesh->points.size();
        triangles += object.mesh->triangles.size();
    }
    if (found.triangles.size() != triangles)
        fail(fmt::format("it has {} triangles instead of {}", found.triangles.size(), triangles));
    const MeshFormat format = mesh_format(file);
    // STL does not say which points are one; those at the same place are taken for it.
    if (found.points.size() != points && format != MeshFormat::stl)
        fail(fmt::format("it has {} points instead of {}", found.points.size(), points));
    // To metres and back, a coordinate is rounded twice.
    const float slack = format == MeshFormat::glb ? std::numeric_limits<float>::epsilon() : 0;
    std::size_t at = 0;
    for (const MeshObject& object : objects) {
        for (const Triangle& t : object.mesh->triangles) {
            for (std::size_t c = 0; c < 3; ++c) {
                const Vec3f &a = object.mesh->points[t[c]], &b = found.points[found.triangles[at][c]];
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    if (!(std::abs(a[axis] - b[axis]) <= slack * std::abs(a[axis])))
                        fail(fmt::format("its triangle {} lies elsewhere or faces another way", at));
                }
            }
            ++at;
        }
    }
}

}  // namespace marrow
