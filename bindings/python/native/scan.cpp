// Reads scans.
#include <marrow/scan_io.h>

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <string>
#include <utility>

#include "label_table.h"
#include "long_work.h"
#include "module.h"
#include "text.h"
#include "vectors.h"
#include "volume.h"

namespace py = pybind11;
using namespace py::literals;

namespace marrow::python {

namespace {

ScanOptions options_of(std::optional<std::string> series, std::optional<Vec3d> spacing, bool resample,
                       std::optional<std::int64_t> volume, std::optional<std::int64_t> level, int threads) {
    return {.series = std::move(series),
            .spacing = spacing,
            .resample = resample,
            .volume = volume,
            .level = level,
            .keep_stored = true,
            .threads = threads};
}

py::dict dict_of(const SeriesInfo& info) {
    const auto [nx, ny, nz] = info.dims;
    return py::dict("id"_a = readable(info.id), "description"_a = readable(info.description),
                    "modality"_a = readable(info.modality), "shape"_a = py::make_tuple(nz, ny, nx),
                    "spacing"_a = info.spacing, "files"_a = info.files, "labels"_a = entries_of(info.labels));
}

py::dict dict_of(const ScanInfo& info) {
    return py::dict("format"_a = scan_format_name(info.format), "series"_a = dict_of(info.series),
                    "warnings"_a = readable(info.warnings), "padding"_a = info.padding);
}

py::dict dict_of(const SeriesReport& report) {
    py::list levels;
    for (const auto& [nx, ny, nz] : report.levels) levels.append(py::make_tuple(nz, ny, nx));
    py::object refusal = py::none();
    if (report.refusal) refusal = readable(*report.refusal);
    return py::dict("series"_a = dict_of(report.series), "number"_a = report.number,
                    "date"_a = readable(report.date), "echo_time"_a = report.echo_time,
                    "image_type"_a = readable(report.image_type), "kernel"_a = readable(report.kernel),
                    "refusal"_a = refusal, "warnings"_a = readable(report.warnings),
                    "gaps"_a = readable(report.gaps), "tilt"_a = report.tilt,
                    "hounsfield"_a = report.hounsfield, "smallest_feature"_a = report.smallest_feature,
                    "memory"_a = report.memory, "volumes"_a = readable(report.volumes),
                    "levels"_a = py::tuple(levels), "patient_name"_a = readable(report.patient_name));
}

py::dict dict_of(const ScanReport& report) {
    py::list series;
    for (const SeriesReport& one : report.series) series.append(dict_of(one));
    return py::dict("format"_a = scan_format_name(report.format), "files"_a = report.files,
                    "series"_a = py::tuple(series), "chosen"_a = report.chosen,
                    "reason"_a = readable(report.reason), "warnings"_a = readable(report.warnings));
}

py::tuple read(const std::filesystem::path& path, std::optional<std::string> series,
               std::optional<Vec3d> spacing, bool resample, std::optional<std::int64_t> volume,
               std::optional<std::int64_t> level, int threads, const py::object& progress) {
    ScanInfo info;
    Volume scan = compute(progress, [&](const Progress& report) {
        ScanOptions options = options_of(std::move(series), spacing, resample, volume, level, threads);
        options.progress = report;
        return read_scan(path, options, &info);
    });
    return py::make_tuple(to_python(std::move(scan)), dict_of(info));
}

py::dict inspect(const std::filesystem::path& path, std::optional<std::string> series,
                 std::optional<Vec3d> spacing, bool resample, std::optional<std::int64_t> volume,
                 std::optional<std::int64_t> level, int threads, const py::object& progress) {
    return dict_of(compute(progress, [&](const Progress& report) {
        ScanOptions options = options_of(std::move(series), spacing, resample, volume, level, threads);
        options.progress = report;
        return inspect_scan(path, options);
    }));
}

}  // namespace

void add_scan(py::module_& module) {
    module.def("read", &read, py::arg("path"), py::kw_only(), py::arg("series") = py::none(),
               py::arg("spacing") = py::none(), py::arg("resample") = false, py::arg("volume") = py::none(),
               py::arg("level") = py::none(), py::arg("threads") = 0, py::arg("progress") = py::none());
    module.def("inspect", &inspect, py::arg("path"), py::kw_only(), py::arg("series") = py::none(),
               py::arg("spacing") = py::none(), py::arg("resample") = false, py::arg("volume") = py::none(),
               py::arg("level") = py::none(), py::arg("threads") = 0, py::arg("progress") = py::none());
}

}  // namespace marrow::python
