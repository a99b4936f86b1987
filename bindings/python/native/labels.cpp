// Surfaces of label maps, and tables of labels.
#include <marrow/labels.h>

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <utility>
#include <vector>

#include "label_table.h"
#include "long_work.h"
#include "mesh.h"
#include "module.h"
#include "volume.h"

namespace py = pybind11;

namespace marrow::python {

namespace {

py::dict labels(const ArrayVolume& map, std::int64_t background, int relax, bool normals, int threads,
                const py::object& progress) {
    std::vector<LabelSurface> surfaces = compute(progress, [&](const Progress& report) {
        return extract_labels(map.view(), {.background = background,
                                           .relax = relax,
                                           .normals = normals,
                                           .threads = threads,
                                           .progress = report});
    });
    py::dict meshes;
    for (LabelSurface& surface : surfaces)
        meshes[py::int_(surface.label)] = to_python(std::move(surface.mesh));
    return meshes;
}

py::dict read_table(const std::filesystem::path& path) {
    return entries_of(compute(py::none(), [&](const Progress&) { return read_label_table(path); }));
}

}  // namespace

void add_labels(py::module_& module) {
    module.def("labels", &labels, py::arg("map"), py::kw_only(), py::arg("background") = 0,
               py::arg("relax") = 40, py::arg("normals") = true, py::arg("threads") = 0,
               py::arg("progress") = py::none());
    module.def(
        "count_labels",
        [](const ArrayVolume& map, int threads, const py::object& progress) {
            return compute(progress, [&](const Progress& report) {
                return count_labels(map.view(), {.threads = threads, .progress = report});
            });
        },
        py::arg("map"), py::kw_only(), py::arg("threads") = 0, py::arg("progress") = py::none());
    module.def("read_label_table", &read_table, py::arg("path"));
    module.def(
        "default_label_colour", [](std::int64_t label) { return colour_tuple(default_label_colour(label)); },
        py::arg("label"));
}

}  // namespace marrow::python
