// How far the points of a surface can be trusted.
#include <marrow/trust.h>

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <optional>

#include "long_work.h"
#include "mesh.h"
#include "module.h"
#include "volume.h"

namespace py = pybind11;
using namespace py::literals;

namespace marrow::python {

namespace {

py::dict dict_of(const TrustPercentiles& p) {
    return py::dict("median"_a = p.median, "percentile_90"_a = p.percentile_90,
                    "percentile_99"_a = p.percentile_99, "capped"_a = p.capped);
}

py::dict dict_of(const NoiseEstimate& n) {
    return py::dict("sigma"_a = n.sigma, "lowest"_a = n.lowest, "highest"_a = n.highest,
                    "local_deviation"_a = n.local_deviation, "slices"_a = n.slices,
                    "laplacian"_a = n.laplacian, "windows"_a = n.windows);
}

py::array_t<float> array_of(const Buffer<float>& values) {
    return py::array_t<float>(static_cast<py::ssize_t>(values.size()), values.data());
}

py::dict trust(const ArrayVolume& volume, const ArrayMesh& mesh, std::optional<double> step, int threads,
               const py::object& progress) {
    const TrustReport report = compute(progress, [&](const Progress& report) {
        return report_trust(volume.view(), mesh.view().points,
                            {.step = step, .threads = threads, .progress = report});
    });
    return py::dict("step"_a = report.step, "cap"_a = report.cap, "noise"_a = dict_of(report.noise),
                    "shift"_a = array_of(report.shift), "noise_shift"_a = array_of(report.noise_shift),
                    "shifts"_a = dict_of(report.shifts), "noise_shifts"_a = dict_of(report.noise_shifts),
                    "border_points"_a = report.border_points);
}

}  // namespace

void add_trust(py::module_& module) {
    module.def("trust", &trust, py::arg("volume"), py::arg("mesh"), py::kw_only(),
               py::arg("step") = py::none(), py::arg("threads") = 0, py::arg("progress") = py::none());
}

}  // namespace marrow::python
