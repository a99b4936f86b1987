// Mesh files.
#include <marrow/mesh_io.h>

#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <array>
#include <cstdint>
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

// Numbers of points with their name and meaning.
using Numbers = std::tuple<std::string, std::string, py::array_t<float, py::array::c_style>>;
using Colours = py::array_t<std::uint8_t, py::array::c_style>;

// A mesh with its name and colour, and the numbers and colours of its points.
using Surface = std::tuple<const ArrayMesh*, std::string, std::optional<std::array<double, 3>>,
                           std::vector<Numbers>, std::optional<Colours>>;

MeshObject object_of(const Surface& surface) {
    const auto& [mesh, name, colour, numbers, colours] = surface;
    MeshObject object{mesh->view(), name, colour};
    for (const auto& [array_name, meaning, values] : numbers)
        object.arrays.push_back(
            {array_name, meaning, {values.data(), static_cast<std::size_t>(values.size())}});
    if (colours) {
        if (colours->ndim() != 2 || colours->shape(1) != 3)
            throw InputError("colours of points are not an array of uint8 with the shape (n, 3)");
        object.point_colours = {reinterpret_cast<const Rgb8*>(colours->data()),
                                static_cast<std::size_t>(colours->shape(0))};
    }
    return object;
}

void write(const std::vector<Surface>& surfaces, const std::filesystem::path& path, const std::string& space,
           const py::object& progress) {
    const Space in = space_named(space);
    std::vector<MeshObject> objects;
    for (const Surface& surface : surfaces) objects.push_back(object_of(surface));
    run_long_work(progress, [&](const Progress& report) { write_meshes(objects, path, {in, report}); });
}

py::tuple read(const std::filesystem::path& path) {
    Space stated = Space::none;
    Mesh mesh =
        compute(py::none(), [&](const Progress& progress) { return read_mesh(path, &stated, progress); });
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
