#include "mesh.h"

#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <utility>

#include <marrow/error.h>

#include "module.h"

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

// The rows of a C-contiguous array of (n, 3) elements of type T, whose bits are also those of `Row`.
template <class Row, class T>
bool find_rows(const py::object& object, std::span<const Row>& rows) {
    using Array = py::array_t<T, py::array::c_style>;
    if (!py::isinstance<Array>(object)) return false;
    const auto array = py::reinterpret_borrow<Array>(object);
    const bool aligned = reinterpret_cast<std::uintptr_t>(array.data()) % alignof(T) == 0;
    if (array.ndim() != 2 || array.shape(1) != 3 || !aligned) return false;
    rows = {reinterpret_cast<const Row*>(array.data()), static_cast<std::size_t>(array.shape(0))};
    return true;
}

}  // namespace

ArrayMesh::ArrayMesh(const py::object& points, const py::object& triangles, const py::object& normals)
    : points_(points), triangles_(triangles), normals_(normals) {
    if (!find_rows<Vec3f, float>(points, view_.points))
        throw InputError("points are not a C-contiguous array of float32 with the shape (n, 3)");
    if (!find_rows<Triangle, std::int32_t>(triangles, view_.triangles) &&
        !find_rows<Triangle, std::uint32_t>(triangles, view_.triangles))
        throw InputError("triangles are not a C-contiguous array of int32 with the shape (m, 3)");
    if (normals.is_none()) return;
    if (!find_rows<Vec3f, float>(normals, view_.normals) || view_.normals.size() != view_.points.size())
        throw InputError("normals are not a C-contiguous array of float32 with the shape of points");
}

py::tuple to_python(Mesh&& mesh) {
    return to_python(std::make_shared<Mesh>(std::move(mesh)));
}

py::tuple to_python(const std::shared_ptr<Mesh>& mesh) {
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

void add_mesh(py::module_& module) {
    py::class_<ArrayMesh>(module, "ArrayMesh")
        .def(py::init<const py::object&, const py::object&, const py::object&>(), py::arg("points"),
             py::arg("triangles"), py::arg("normals"));
}

}  // namespace marrow::python
