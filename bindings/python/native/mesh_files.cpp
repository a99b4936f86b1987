// Mesh files.
#include <marrow/mesh_io.h>

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <array>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "long_work.h"
#include "mesh.h"
#include "mesh_files.h"
#include "module.h"

namespace py = pybind11;

namespace marrow::python {

namespace {

constexpr std::array<std::pair<const char*, Space>, 3> kSpaces{
    {{"LPS", Space::LPS}, {"RAS", Space::RAS}, {"none", Space::none}}};

// A mesh with its name and colour.
using Surface = std::tuple<const ArrayMesh*, std::string, std::optional<std::array<double, 3>>>;

void write(const std::vector<Surface>& surfaces, const std::filesystem::path& path, const std::string& space,
           const py::object& progress) {
    const Space in = space_named(space);
    run_long_work(progress, [&](const Progress& report) {
        std::vector<MeshObject> objects;
        for (const auto& [mesh, name, colour] : surfaces) objects.push_back({mesh->view(), name, colour});
        write_meshes(objects, path, {in, report});
    });
}

py::tuple read(const std::filesystem::path& path) {
    Space stated = Space::none;
    Mesh mesh = compute(py::none(), [&](const Progress&) { return read_mesh(path, &stated); });
    const char* name = nullptr;
    for (const auto& [text, space] : kSpaces) {
        if (space == stated) name = text;
    }
    return py::make_tuple(to_python(std::move(mesh)), name);
}

}  // namespace

Space space_named(const std::string& name) {
    for (const auto& [text, space] : kSpaces) {
        if (name == text) return space;
    }
    throw InputError(fmt::format("space is 'LPS', 'RAS' or 'none', not '{}'", name));
}

void add_mesh_files(py::module_& module) {
    module.def("write_meshes", &write, py::arg("surfaces"), py::arg("path"), py::kw_only(),
               py::arg("space") = "LPS", py::arg("progress") = py::none());
    module.def("read_mesh", &read, py::arg("path"));
}

}  // namespace marrow::python
