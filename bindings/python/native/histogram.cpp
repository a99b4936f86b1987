// How a volume's samples are distributed, and how its surface depends on the isovalue.
#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <optional>
#include <vector>

#include <marrow/error.h>
#include <marrow/histogram.h>
#include <marrow/isovalue_sweep.h>

#include "long_work.h"
#include "module.h"
#include "volume.h"

namespace py = pybind11;
using namespace py::literals;

namespace marrow::python {

namespace {

template <class T>
py::array_t<T> column(const std::vector<SweepSample>& samples, T SweepSample::*member) {
    py::array_t<T> values(static_cast<py::ssize_t>(samples.size()));
    T* to = values.mutable_data();
    for (const SweepSample& sample : samples) *to++ = sample.*member;
    return values;
}

py::dict sweep(const ArrayVolume& volume, const std::vector<double>& isovalues, bool topology, int threads,
               const py::object& progress) {
    const std::vector<SweepSample> samples = compute(progress, [&](const Progress& report) {
        return sweep_isovalues(volume.view(), isovalues,
                               {.threads = threads, .progress = report, .topology = topology});
    });
    return py::dict("isovalue"_a = column(samples, &SweepSample::isovalue),
                    "volume"_a = column(samples, &SweepSample::volume),
                    "area"_a = column(samples, &SweepSample::area),
                    "components"_a = column(samples, &SweepSample::components),
                    "triangles"_a = column(samples, &SweepSample::triangles));
}

// Pairs of the first and the last isovalue.
std::vector<std::pair<double, double>> plateaus(const std::vector<double>& isovalue,
                                                const std::vector<double>& volume,
                                                const std::vector<double>& area,
                                                const std::vector<std::int64_t>& triangles, double spacing,
                                                double contrast) {
    const std::size_t count = isovalue.size();
    if (volume.size() != count || area.size() != count || triangles.size() != count)
        throw InputError("the arrays of a sweep must have the same length");
    std::vector<SweepSample> samples;
    for (std::size_t i = 0; i < isovalue.size(); ++i)
        samples.push_back(
            {.isovalue = isovalue[i], .volume = volume[i], .area = area[i], .triangles = triangles[i]});
    std::vector<std::pair<double, double>> ranges;
    for (const Plateau& plateau : find_plateaus(samples, spacing, contrast))
        ranges.emplace_back(isovalue[plateau.first], isovalue[plateau.last]);
    return ranges;
}

Histogram histogram_of(const ArrayVolume& volume, int bins, std::optional<double> padding) {
    return compute(py::none(), [&](const Progress&) { return histogram(volume.view(), bins, padding); });
}

}  // namespace

void add_histogram(py::module_& module) {
    module.def(
        "histogram",
        [](const ArrayVolume& volume, int bins, std::optional<double> padding) {
            const Histogram result = histogram_of(volume, bins, padding);
            return py::dict("lower"_a = result.lower, "upper"_a = result.upper,
                            "counts"_a = py::array_t<std::int64_t>(
                                static_cast<py::ssize_t>(result.counts.size()), result.counts.data()),
                            "non_finite_samples"_a = result.non_finite_samples);
        },
        py::arg("volume"), py::arg("bins"), py::arg("padding") = py::none());
    module.def(
        "otsu",
        [](const ArrayVolume& volume, std::optional<double> padding) {
            return otsu_isovalue(histogram_of(volume, 256, padding));
        },
        py::arg("volume"), py::arg("padding"));
    module.def(
        "otsu_contrast",
        [](const ArrayVolume& volume, std::optional<double> padding) {
            return otsu_contrast(histogram_of(volume, 256, padding));
        },
        py::arg("volume"), py::arg("padding"));
    module.def("sweep", &sweep, py::arg("volume"), py::arg("isovalues"), py::kw_only(),
               py::arg("topology") = false, py::arg("threads") = 0, py::arg("progress") = py::none());
    module.def("find_plateaus", &plateaus, py::arg("isovalue"), py::arg("volume"), py::arg("area"),
               py::arg("triangles"), py::arg("spacing"), py::arg("contrast"));
}

}  // namespace marrow::python
