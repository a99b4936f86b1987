// Label maps in parts, for processes that work on them together.
#include <marrow/label_parts.h>

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <array>
#include <cstdint>
#include <memory>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "long_work.h"
#include "mesh.h"
#include "module.h"
#include "parts.h"

namespace py = pybind11;

namespace marrow::python {

namespace {

// An array of three columns that owns the rows of a buffer, without a copy.
template <class Row>
py::array rows_to_array(Buffer<Row>&& rows) {
    using T = std::remove_cvref_t<decltype(rows[0][0])>;
    static_assert(sizeof(Row) == 3 * sizeof(T));
    const std::array<py::ssize_t, 2> shape{static_cast<py::ssize_t>(rows.size()), 3};
    auto owner = std::make_unique<Buffer<Row>>(std::move(rows));
    const py::capsule capsule(owner.get(), [](void* p) { delete static_cast<Buffer<Row>*>(p); });
    return py::array_t<T>(shape, reinterpret_cast<const T*>(owner.release()->data()), capsule);
}

py::tuple as_tuple(LabelPart&& part) {
    py::list surfaces;
    for (LabelPart::Surface& surface : part.surfaces)
        surfaces.append(py::make_tuple(surface.label, to_array(std::move(surface.keys)),
                                       to_array(std::move(surface.net_points)),
                                       rows_to_array(std::move(surface.triangles))));
    return py::make_tuple(part.whole, part.first, part.dims, to_array(std::move(part.net_keys)),
                          rows_to_array(std::move(part.positions)),
                          rows_to_array(std::move(part.positions_before_relaxation)), surfaces);
}

LabelPart to_part(const py::handle& tuple) {
    const auto [whole, first, dims, net_keys, positions, before, surfaces] =
        tuple.cast<std::tuple<Index, Index, Index, py::object, py::object, py::object, py::list>>();
    LabelPart part{whole,
                   first,
                   dims,
                   to_vector<Buffer<std::uint64_t>>(net_keys),
                   to_vector<Buffer<Vec3f>>(positions),
                   to_vector<Buffer<Vec3f>>(before),
                   {}};
    for (const py::handle item : surfaces) {
        const auto [label, keys, net_points, triangles] =
            item.cast<std::tuple<std::int64_t, py::object, py::object, py::object>>();
        part.surfaces.push_back({label, to_vector<Buffer<std::uint64_t>>(keys),
                                 to_vector<Buffer<std::uint32_t>>(net_points),
                                 to_vector<Buffer<Triangle>>(triangles)});
    }
    return part;
}

py::tuple python_extract_label_part(const ArrayPart& part, std::int64_t background, int relax, int threads,
                                    const py::object& progress) {
    return as_tuple(compute(progress, [&](const Progress& report) {
        return extract_label_part(
            part.view(), part.whole(),
            {.background = background, .relax = relax, .threads = threads, .progress = report});
    }));
}

py::dict python_merge_label_parts(const py::list& list, bool normals, const py::object& progress) {
    std::vector<LabelPart> parts;
    for (const py::handle part : list) parts.push_back(to_part(part));
    std::vector<LabelSurface> surfaces = compute(progress, [&](const Progress& report) {
        return merge_label_parts(parts, {.normals = normals, .progress = report});
    });
    py::dict meshes;
    for (LabelSurface& surface : surfaces)
        meshes[py::int_(surface.label)] = to_python(std::move(surface.mesh));
    return meshes;
}

}  // namespace

void add_label_parts(py::module_& module) {
    module.def(
        "label_part_halo", [](int relax) { return label_part_halo({.relax = relax}); }, py::arg("relax"));
    module.def("extract_label_part", &python_extract_label_part, py::arg("part"), py::kw_only(),
               py::arg("background"), py::arg("relax"), py::arg("threads"), py::arg("progress") = py::none());
    module.def("merge_label_parts", &python_merge_label_parts, py::arg("parts"), py::kw_only(),
               py::arg("normals"), py::arg("progress") = py::none());
}

}  // namespace marrow::python
