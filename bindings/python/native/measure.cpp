// Measures and checks of meshes.
#include <marrow/measure.h>

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <vector>

#include <marrow/mesh_check.h>

#include "long_work.h"
#include "mesh.h"
#include "module.h"
#include "vectors.h"

namespace py = pybind11;
using namespace py::literals;

namespace marrow::python {

namespace {

py::dict dict_of(const MeshMeasures& m) {
    return py::dict("points"_a = m.points, "triangles"_a = m.triangles, "components"_a = m.components,
                    "cavities"_a = m.cavities, "boundary_edges"_a = m.boundary_edges,
                    "nonmanifold_edges"_a = m.nonmanifold_edges,
                    "euler_characteristic"_a = m.euler_characteristic, "area"_a = m.area,
                    "volume"_a = m.volume, "lower"_a = m.lower, "upper"_a = m.upper);
}

py::dict dict_of(const MeshCheck& c) {
    return py::dict(
        "measures"_a = dict_of(c.measures), "misoriented_edges"_a = c.misoriented_edges,
        "nonmanifold_points"_a = c.nonmanifold_points, "unused_points"_a = c.unused_points,
        "degenerate_triangles"_a = c.degenerate_triangles, "cavities"_a = c.cavities, "genus"_a = c.genus,
        "self_intersections"_a = c.self_intersections, "thin_triangles"_a = c.thin_triangles,
        "thin_area"_a = c.thin_area, "thinnest_wall"_a = c.thinnest_wall, "is_closed"_a = c.is_closed(),
        "is_manifold"_a = c.is_manifold(), "is_oriented"_a = c.is_oriented(), "is_sound"_a = c.is_sound());
}

py::dict dict_of(const TriangleQuality& q) {
    return py::dict(
        "smallest_angle"_a = q.smallest_angle, "angle_histogram"_a = py::tuple(py::cast(q.angle_histogram)),
        "median_aspect_ratio"_a = q.median_aspect_ratio, "largest_aspect_ratio"_a = q.largest_aspect_ratio,
        "triangles_without_area"_a = q.triangles_without_area);
}

py::dict check(const ArrayMesh& mesh, std::optional<double> min_wall, int threads,
               const py::object& progress) {
    return dict_of(compute(progress, [&](const Progress& report) {
        return check_mesh(mesh.view(), {.min_wall = min_wall, .threads = threads, .progress = report});
    }));
}

py::dict roughness_of(const ArrayMesh& mesh, double window, int threads, const py::object& progress) {
    const Roughness r = compute(progress, [&](const Progress& report) {
        return roughness(mesh.view(), window, {.threads = threads, .progress = report});
    });
    return py::dict("roughness"_a = r.roughness, "mean_curvature"_a = r.mean_curvature,
                    "points"_a = r.points);
}

py::array_t<double> curvature(const ArrayMesh& mesh, int threads, const py::object& progress) {
    const std::vector<double> values = compute(progress, [&](const Progress& report) {
        return mean_curvature(mesh.view(), {.threads = threads, .progress = report});
    });
    return py::array_t<double>(static_cast<py::ssize_t>(values.size()), values.data());
}

py::tuple distance(const ArrayMesh& a, const ArrayMesh& b, std::int64_t samples, int threads,
                   const py::object& progress) {
    const MeshDistance d = compute(progress, [&](const Progress& report) {
        return mesh_distance(a.view(), b.view(),
                             {.samples = samples, .threads = threads, .progress = report});
    });
    return py::make_tuple(d.mean, d.max);
}

}  // namespace

void add_measure(py::module_& module) {
    module.def(
        "measure",
        [](const ArrayMesh& mesh, int threads) {
            return dict_of(compute(
                py::none(), [&](const Progress&) { return measure(mesh.view(), {.threads = threads}); }));
        },
        py::arg("mesh"), py::kw_only(), py::arg("threads") = 0);
    module.def(
        "triangle_quality",
        [](const ArrayMesh& mesh) {
            return dict_of(
                compute(py::none(), [&](const Progress&) { return triangle_quality(mesh.view()); }));
        },
        py::arg("mesh"));
    module.def("check", &check, py::arg("mesh"), py::arg("min_wall"), py::kw_only(), py::arg("threads") = 0,
               py::arg("progress") = py::none());
    module.def("roughness", &roughness_of, py::arg("mesh"), py::arg("window"), py::kw_only(),
               py::arg("threads") = 0, py::arg("progress") = py::none());
    module.def("mean_curvature", &curvature, py::arg("mesh"), py::kw_only(), py::arg("threads") = 0,
               py::arg("progress") = py::none());
    module.def("distance", &distance, py::arg("a"), py::arg("b"), py::kw_only(), py::arg("samples") = 200'000,
               py::arg("threads") = 0, py::arg("progress") = py::none());
}

}  // namespace marrow::python
