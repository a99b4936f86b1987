// How far the points of a surface can be trusted.
#include <marrow/trust.h>
#include <marrow/trust_arrays.h>

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <cstring>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "long_work.h"
#include "mesh.h"
#include "module.h"
#include "noise.h"
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

// The names and meanings of the arrays in files.
std::vector<std::pair<std::string, std::string>> meanings_of(const TrustReport& report,
                                                             std::optional<bool> walls_restored,
                                                             bool hounsfield) {
    const ThinWallState walls = !walls_restored   ? ThinWallState::unknown
                                : *walls_restored ? ThinWallState::restored
                                                  : ThinWallState::found;
    std::vector<std::pair<std::string, std::string>> meanings;
    for (const PointArray& array : trust_arrays(report, {}, walls, hounsfield))
        meanings.emplace_back(array.name, array.meaning);
    return meanings;
}

py::array_t<std::uint8_t> colours_of(const TrustReport& report, const std::vector<bool>& near_walls) {
    const std::vector<Rgb8> colours = trust_colours(report, near_walls);
    py::array_t<std::uint8_t> result({static_cast<py::ssize_t>(colours.size()), py::ssize_t{3}});
    std::memcpy(result.mutable_data(), colours.data(), colours.size() * sizeof(Rgb8));
    return result;
}

// `near_walls` is for each point whether it is near a thin wall, or None. `walls_restored` is
// None if no walls were looked for.
py::dict trust(const ArrayVolume& volume, const ArrayMesh& mesh, bool hounsfield,
               std::optional<double> padding, const std::optional<py::array_t<bool>>& near_walls,
               std::optional<bool> walls_restored, int threads, const py::object& progress) {
    const NoiseEstimate noise = noise_of(volume, padding, threads);
    const TrustReport report = compute(progress, [&](const Progress& report) {
        TrustOptions options{.noise = noise, .padding = padding, .threads = threads, .progress = report};
        if (hounsfield) options.step = 100;
        return report_trust(volume.view(), mesh.view().points, options);
    });
    py::array_t<bool> near(static_cast<py::ssize_t>(mesh.view().points.size()));
    std::fill_n(near.mutable_data(), near.size(), false);
    if (near_walls) near = *near_walls;
    return py::dict(
        "step"_a = report.step, "cap"_a = report.cap, "noise"_a = dict_of(report.noise),
        "shift"_a = array_of(report.shift), "noise_shift"_a = array_of(report.noise_shift),
        "shifts"_a = dict_of(report.shifts), "noise_shifts"_a = dict_of(report.noise_shifts),
        "border_points"_a = report.border_points, "near_thin_walls"_a = near,
        "colours"_a = colours_of(report, std::vector<bool>(near.data(), near.data() + near.size())),
        "meanings"_a = meanings_of(report, walls_restored, hounsfield));
}

}  // namespace

void add_trust(py::module_& module) {
    module.def("trust", &trust, py::arg("volume"), py::arg("mesh"), py::kw_only(), py::arg("hounsfield"),
               py::arg("padding") = py::none(), py::arg("near_walls") = py::none(),
               py::arg("walls_restored") = py::none(), py::arg("threads") = 0,
               py::arg("progress") = py::none());
}

}  // namespace marrow::python
