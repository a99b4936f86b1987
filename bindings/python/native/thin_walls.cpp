// Walls too thin for the scan.
#include <marrow/thin_walls.h>

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <optional>

#include "long_work.h"
#include "mesh.h"
#include "module.h"
#include "noise.h"
#include "volume.h"

namespace py = pybind11;

namespace marrow::python {

namespace {

// The walls of a volume, which they keep alive.
class FoundWalls {
  public:
    FoundWalls(const ArrayVolume& volume, double isovalue, const ArrayMesh& mesh, std::optional<double> noise,
               std::optional<double> padding, int threads, const py::object& progress)
        : volume_(volume), isovalue_(isovalue) {
        const double known = noise ? *noise : noise_of(volume, padding, threads).sigma;
        found_ = compute(progress, [&](const Progress& report) {
            return find_thin_walls(
                volume_.view(), isovalue, mesh.view(),
                {.noise = known, .padding = padding, .threads = threads, .progress = report});
        });
    }

    double area() const { return found_.area; }

    py::array_t<double> areas() const {
        py::array_t<double> areas(static_cast<py::ssize_t>(found_.walls.size()));
        for (std::size_t i = 0; i < found_.walls.size(); ++i) areas.mutable_data()[i] = found_.walls[i].area;
        return areas;
    }

    py::array_t<double> positions() const {
        py::array_t<double> positions({static_cast<py::ssize_t>(found_.walls.size()), py::ssize_t{3}});
        for (std::size_t i = 0; i < found_.walls.size(); ++i)
            std::copy_n(found_.walls[i].position.data(), 3, positions.mutable_data() + 3 * i);
        return positions;
    }

    py::tuple restore() const {
        return volume_.to_python(compute(py::none(), [&](const Progress& report) {
            return restore_thin_walls(volume_.view(), isovalue_, found_, report);
        }));
    }

    py::array_t<bool> near(const ArrayMesh& mesh) const {
        const std::vector<bool> near = compute(py::none(), [&](const Progress&) {
            return near_thin_walls(volume_.view(), found_, mesh.view().points);
        });
        py::array_t<bool> result(static_cast<py::ssize_t>(near.size()));
        std::copy(near.begin(), near.end(), result.mutable_data());
        return result;
    }

  private:
    const ArrayVolume volume_;
    const double isovalue_;
    ThinWalls found_;
};

}  // namespace

void add_thin_walls(py::module_& module) {
    py::class_<FoundWalls>(module, "FoundWalls")
        .def(py::init<const ArrayVolume&, double, const ArrayMesh&, std::optional<double>,
                      std::optional<double>, int, const py::object&>(),
             py::arg("volume"), py::arg("isovalue"), py::arg("mesh"), py::kw_only(), py::arg("noise"),
             py::arg("padding"), py::arg("threads"), py::arg("progress"))
        .def_property_readonly("area", &FoundWalls::area)
        .def_property_readonly("areas", &FoundWalls::areas)
        .def_property_readonly("positions", &FoundWalls::positions)
        .def("restore", &FoundWalls::restore)
        .def("near", &FoundWalls::near, py::arg("mesh"));
}

}  // namespace marrow::python
