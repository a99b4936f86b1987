#include "mesh.h"

#include <cstdint>
#include <limits>
#include <memory>
#include <utility>

namespace py = pybind11;

namespace marrow::python {

namespace {

// The array shares `mesh`: it stays alive with the array or any view of it.
py::array rows_of_three(const py::dtype& type, std::size_t rows, const void* data,
                        const std::shared_ptr<Mesh>& mesh) {
    auto share = std::make_unique<std::shared_ptr<Mesh>>(mesh);
    const py::capsule owner(share.get(), [](void* p) { delete static_cast<std::shared_ptr<Mesh>*>(p); });
    share.release();
    return py::array(type, {static_cast<py::ssize_t>(rows), py::ssize_t{3}}, data, owner);
}

}  // namespace

py::tuple to_python(Mesh&& result) {
    const auto mesh = std::make_shared<Mesh>(std::move(result));
    const bool fits = mesh->points.size() <= std::size_t{std::numeric_limits<std::int32_t>::max()} + 1;
    const py::dtype index = fits ? py::dtype::of<std::int32_t>() : py::dtype::of<std::uint32_t>();
    const py::dtype real = py::dtype::of<float>();
    py::object normals = py::none();
    if (!mesh->normals.empty() || mesh->points.empty())
        normals = rows_of_three(real, mesh->normals.size(), mesh->normals.data(), mesh);
    return py::make_tuple(rows_of_three(real, mesh->points.size(), mesh->points.data(), mesh),
                          rows_of_three(index, mesh->triangles.size(), mesh->triangles.data(), mesh),
                          normals);
}

}  // namespace marrow::python
