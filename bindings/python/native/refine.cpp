// Steps that change a surface: components, smoothing, reduction.
#include <pybind11/stl.h>

#include <marrow/components.h>
#include <marrow/simplify.h>
#include <marrow/smooth.h>

#include "long_work.h"
#include "mesh.h"
#include "module.h"
#include "vectors.h"

namespace py = pybind11;

namespace marrow::python {

namespace {

// smooth and simplify change a mesh of their own, which they begin with.
Mesh copy_of(const MeshView& mesh) {
    return {{mesh.points.begin(), mesh.points.end()},
            {mesh.normals.begin(), mesh.normals.end()},
            {mesh.triangles.begin(), mesh.triangles.end()}};
}

py::tuple components(const ArrayMesh& mesh, std::optional<std::int64_t> count, double min_volume,
                     bool cavities, int threads) {
    return to_python(compute(py::none(), [&](const Progress&) {
        return keep_components(
            mesh.view(),
            {.count = count, .min_volume = min_volume, .cavities = cavities, .threads = threads});
    }));
}

py::tuple smoothed(const ArrayMesh& mesh, int iterations, double pass_band, const std::optional<Mat3d>& bound,
                   std::optional<double> max_move, int threads, const py::object& progress) {
    return to_python(compute(progress, [&](const Progress& report) {
        return smooth(copy_of(mesh.view()), {.iterations = iterations,
                                             .pass_band = pass_band,
                                             .bound = bound,
                                             .max_move = max_move,
                                             .threads = threads,
                                             .progress = report});
    }));
}

py::tuple simplified(const ArrayMesh& mesh, std::optional<std::int64_t> triangles,
                     std::optional<double> max_error, int threads, const py::object& progress) {
    return to_python(compute(progress, [&](const Progress& report) {
        return simplify(
            copy_of(mesh.view()),
            {.triangles = triangles, .max_error = max_error, .threads = threads, .progress = report});
    }));
}

}  // namespace

void add_refine(py::module_& module) {
    module.def("keep_components", &components, py::arg("mesh"), py::kw_only(), py::arg("count") = py::none(),
               py::arg("min_volume") = 0.0, py::arg("cavities") = true, py::arg("threads") = 0);
    module.def("smooth", &smoothed, py::arg("mesh"), py::kw_only(), py::arg("iterations") = 20,
               py::arg("pass_band") = 0.1, py::arg("bound") = py::none(), py::arg("max_move") = py::none(),
               py::arg("threads") = 0, py::arg("progress") = py::none());
    module.def("simplify", &simplified, py::arg("mesh"), py::kw_only(), py::arg("triangles") = py::none(),
               py::arg("max_error") = py::none(), py::arg("threads") = 0, py::arg("progress") = py::none());
}

}  // namespace marrow::python
