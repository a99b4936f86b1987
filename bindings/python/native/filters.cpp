// Filters that prepare a volume for extraction.
#include <pybind11/stl.h>

#include <marrow/volume_filters.h>

#include "long_work.h"
#include "module.h"
#include "vectors.h"
#include "volume.h"

namespace py = pybind11;

namespace marrow::python {

namespace {

py::tuple filtered(const ArrayVolume& volume, const py::object& progress, int threads,
                   const std::function<Volume(const FilterOptions&)>& filter) {
    return volume.to_python(compute(
        progress, [&](const Progress& report) { return filter({.threads = threads, .progress = report}); }));
}

}  // namespace

void add_filters(py::module_& module) {
    module.def(
        "crop",
        [](const ArrayVolume& volume, const Vec3d& lower, const Vec3d& upper) {
            return filtered(volume, py::none(), 0, [&](const FilterOptions&) {
                return crop(volume.view(), Box{lower, upper});
            });
        },
        py::arg("volume"), py::arg("lower"), py::arg("upper"));
    module.def(
        "median_filter",
        [](const ArrayVolume& volume, int radius, int threads, const py::object& progress) {
            return filtered(volume, progress, threads, [&](const FilterOptions& options) {
                return median_filter(volume.view(), radius, options);
            });
        },
        py::arg("volume"), py::arg("radius"), py::kw_only(), py::arg("threads") = 0,
        py::arg("progress") = py::none());
    module.def(
        "gaussian_filter",
        [](const ArrayVolume& volume, double sigma, int threads, const py::object& progress) {
            return filtered(volume, progress, threads, [&](const FilterOptions& options) {
                return gaussian_filter(volume.view(), sigma, options);
            });
        },
        py::arg("volume"), py::arg("sigma"), py::kw_only(), py::arg("threads") = 0,
        py::arg("progress") = py::none());
    module.def(
        "resample_isotropic",
        [](const ArrayVolume& volume, double spacing, int threads, const py::object& progress) {
            const ArrayVolume ordered = volume.in_array_order();  // as the first sample stays
            return filtered(ordered, progress, threads, [&](const FilterOptions& options) {
                return resample_isotropic(ordered.view(), spacing, options);
            });
        },
        py::arg("volume"), py::arg("spacing"), py::kw_only(), py::arg("threads") = 0,
        py::arg("progress") = py::none());
}

}  // namespace marrow::python
