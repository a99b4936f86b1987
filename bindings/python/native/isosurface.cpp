// Isosurfaces of arrays.
#include "isosurface.h"

#include <utility>

#include <marrow/isosurface.h>

#include "long_work.h"
#include "mesh.h"
#include "volume.h"

namespace py = pybind11;

namespace marrow::python {

namespace {

py::tuple extract(const ArrayVolume& volume, double isovalue, bool closed, bool normals, double snap,
                  int threads, const py::object& progress) {
    Mesh mesh;
    run_long_work(progress, [&](const Progress& report) {
        mesh = extract_isosurface(
            volume.view(), isovalue,
            {.normals = normals, .closed = closed, .snap = snap, .threads = threads, .progress = report});
    });
    return to_python(std::move(mesh));
}

}  // namespace

void add_isosurface(py::module_& module) {
    module.def("extract", &extract, py::arg("volume"), py::arg("isovalue"), py::kw_only(),
               py::arg("closed") = false, py::arg("normals") = true, py::arg("snap") = 0.0,
               py::arg("threads") = 0, py::arg("progress") = py::none());
}

}  // namespace marrow::python
