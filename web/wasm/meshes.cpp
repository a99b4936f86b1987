// Measures, changes, checks and writes meshes.
#include <cmath>
#include <map>
#include <vector>

#include <marrow/components.h>
#include <marrow/error.h>
#include <marrow/measure.h>
#include <marrow/mesh_check.h>
#include <marrow/mesh_io.h>
#include <marrow/simplify.h>
#include <marrow/smooth.h>

#include "json.h"
#include "shared/console.h"

namespace marrow::web {
namespace {

std::map<int, Mesh> meshes;
int last_mesh = 0;

const Mesh& mesh_of(const Json& request) {
    return meshes.at(request.at("mesh").get<int>());
}

Json measures_of(const MeshMeasures& m) {
    return {{"points", m.points},
            {"triangles", m.triangles},
            {"components", m.components},
            {"cavities", m.cavities},
            {"boundaryEdges", m.boundary_edges},
            {"nonmanifoldEdges", m.nonmanifold_edges},
            {"area", m.area},
            {"volume", m.volume},
            {"lower", {m.lower[0], m.lower[1], m.lower[2]}},
            {"upper", {m.upper[0], m.upper[1], m.upper[2]}}};
}

}  // namespace

Json describe(const Mesh& mesh) {
    return {{"points", array_of(mesh.points.data(), 3 * mesh.points.size())},
            {"normals", array_of(mesh.normals.data(), 3 * mesh.normals.size())},
            {"triangles", array_of(mesh.triangles.data(), 3 * mesh.triangles.size())}};
}

Json keep_mesh(Mesh mesh) {
    Mesh& kept = meshes[++last_mesh] = std::move(mesh);
    Json out = describe(kept);
    out["mesh"] = last_mesh;
    return out;
}

// JavaScript writes the arrays.
Json create_mesh(const Json& request) {
    Mesh mesh;
    mesh.points.resize(request.at("points").get<std::size_t>());
    mesh.normals.resize(request.at("normals").get<std::size_t>());
    mesh.triangles.resize(request.at("triangles").get<std::size_t>());
    return keep_mesh(std::move(mesh));
}

Json drop_mesh(const Json& request) {
    meshes.erase(request.at("mesh").get<int>());
    return Json::object();
}

Json keep_components(const Json& request) {
    ComponentOptions options{.count = member<std::int64_t>(request, "count"),
                             .min_volume = request.value("minVolume", 0.0),
                             .cavities = request.value("cavities", true)};
    if (request.value("largest", false)) {
        options.count = 1;
        options.cavities = false;
    }
    return keep_mesh(marrow::keep_components(mesh_of(request), options));
}

Json smooth(const Json& request) {
    SmoothOptions options{.iterations = request.at("iterations").get<int>(),
                          .max_move = member<double>(request, "maxMove"),
                          .progress = progress()};
    if (const auto bound = member<std::vector<double>>(request, "bound")) {
        Mat3d& matrix = options.bound.emplace();
        for (std::size_t i = 0; i < 9; ++i) matrix[i / 3][i % 3] = bound->at(i);
    }
    SmoothStats stats;
    Json out = keep_mesh(marrow::smooth(mesh_of(request), options, &stats));
    out["movedMean"] = stats.moved_mean;
    out["movedMax"] = stats.moved_max;
    out["heldBack"] = stats.held_back_points;
    out["restored"] = stats.restored_components;
    return out;
}

Json simplify(const Json& request) {
    const Mesh& mesh = mesh_of(request);
    SimplifyOptions options{.triangles = member<std::int64_t>(request, "triangles"),
                            .max_error = member<double>(request, "maxError"),
                            .progress = progress()};
    if (const auto keep = member<double>(request, "keep"))
        options.triangles = std::llround(*keep * static_cast<double>(mesh.triangles.size()));
    SimplifyStats stats;
    Json out = keep_mesh(marrow::simplify(mesh, options, &stats));
    out["deviationMean"] = stats.deviation.mean;
    out["deviationMax"] = stats.deviation.max;
    if (options.triangles) out["wanted"] = *options.triangles;
    return out;
}

Json measure(const Json& request) {
    return measures_of(marrow::measure(mesh_of(request)));
}

Json check(const Json& request) {
    const MeshCheck found = check_mesh(
        mesh_of(request), {.min_wall = member<double>(request, "minWall"), .progress = progress()});
    Json out{{"sound", found.is_sound()},
             {"closed", found.is_closed()},
             {"manifold", found.is_manifold()},
             {"oriented", found.is_oriented()},
             {"selfIntersections", found.self_intersections},
             {"degenerateTriangles", found.degenerate_triangles},
             {"misorientedEdges", found.misoriented_edges},
             {"nonmanifoldPoints", found.nonmanifold_points},
             {"unusedPoints", found.unused_points},
             {"cavities", found.cavities},
             {"thinTriangles", found.thin_triangles},
             {"thinArea", found.thin_area},
             {"measures", measures_of(found.measures)}};
    if (found.genus) out["genus"] = *found.genus;
    if (found.thinnest_wall) out["thinnestWall"] = *found.thinnest_wall;
    return out;
}

Json write(const Json& request) {
    std::vector<MeshObject> objects;
    for (const Json& object : request.at("objects")) {
        const Mesh& mesh = mesh_of(object);
        if (mesh.triangles.empty())
            throw apps::EmptySurface("there is no surface to write: the mesh has no triangles");
        objects.push_back({mesh, object.value("name", ""), member<std::array<double, 3>>(object, "colour")});
    }
    const Space space = request.at("space") == "RAS" ? Space::RAS : Space::LPS;
    write_meshes(objects, request.at("file").get<std::string>(), {.space = space, .progress = progress()});
    return Json::object();
}

}  // namespace marrow::web
