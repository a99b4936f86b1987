// Surfaces of volumes that do not fit in memory.
#include <marrow/streaming.h>

#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <marrow/mesh_io.h>
#include <marrow/scan_io.h>

#include "errors.h"
#include "long_work.h"
#include "mesh_files.h"
#include "module.h"
#include "vectors.h"
#include "volume.h"

namespace py = pybind11;

namespace marrow::python {

namespace {

struct FileOptions {
    double isovalue;
    std::filesystem::path path;
    std::size_t max_memory;
    bool closed;
    bool topology;
    Space space;
    int threads;
};

[[noreturn]] void throw_empty(const Geometry& geometry, const FileOptions& options,
                              std::int64_t non_finite_samples) {
    if (!options.closed && *std::min_element(geometry.dims.begin(), geometry.dims.end()) < 2)
        throw EmptySurface("an open surface needs at least 2 samples along each axis: give closed=True");
    if (non_finite_samples == geometry.sample_count())
        throw EmptySurface("the volume has no finite sample, so there is no surface");
    throw EmptySurface(
        fmt::format("no surface at isovalue {}: all finite samples are on one side of it", options.isovalue));
}

// Returns the numbers of points and triangles.
std::pair<std::uint64_t, std::uint64_t> write_surface(const SliceSource& source, const FileOptions& options,
                                                      const Progress& progress) {
    SurfaceWriter writer(options.path, {options.space, {}});
    SurfaceSink sink = writer.sink();
    std::pair<std::uint64_t, std::uint64_t> size;
    IsosurfaceStats stats;
    sink.begin = [&, begin = sink.begin](std::uint64_t points, std::uint64_t triangles, bool normals) {
        if (triangles == 0) throw_empty(source.geometry, options, stats.non_finite_samples);
        size = {points, triangles};
        begin(points, triangles, normals);
    };
    // With normals, so that the file has the same bytes as that of a surface extracted in memory.
    extract_isosurface_in_slabs(source, options.isovalue, sink, {.memory = options.max_memory},
                                {.closed = options.closed,
                                 .topology = options.topology,
                                 .threads = options.threads,
                                 .progress = progress},
                                &stats);
    writer.commit();
    return size;
}

std::pair<std::uint64_t, std::uint64_t> file_to_file(const std::filesystem::path& scan,
                                                     const std::optional<Vec3d>& spacing,
                                                     const FileOptions& options, const py::object& progress) {
    return compute(progress, [&](const Progress& report) {
        return write_surface(
            open_slices(scan, {.spacing = spacing, .keep_stored = true, .threads = options.threads}), options,
            report);
    });
}

// Calls read(first, last) on the calling thread. It returns an array [k, j, i] of the slices
// first <= k < last. It does not get the memory to fill: the traceback of an exception would keep that for
// longer than it exists.
std::pair<std::uint64_t, std::uint64_t> slices_to_file(const py::function& read, const Geometry& geometry,
                                                       const py::dtype& type, std::int64_t slices_at_once,
                                                       const Rescale& rescale, const FileOptions& options,
                                                       const py::object& progress) {
    SliceSource source{geometry,
                       sample_type_of(type),
                       {},
                       slices_at_once,
                       rescale};  // here, where the thread holds the lock
    std::pair<std::uint64_t, std::uint64_t> size;
    run_long_work(progress, [&](const Progress& report, const CallPython& call) {
        source.read = [&](std::int64_t first, std::int64_t last, void* samples) {
            call([&] {
                const py::object slices = read(first, last);
                const std::vector<py::ssize_t> shape{last - first, geometry.dims[1], geometry.dims[0]};
                py::array(type, shape, samples, py::capsule(samples))
                    .attr("__setitem__")(py::ellipsis(), slices);
            });
        };
        size = write_surface(source, options, report);
    });
    return size;
}

}  // namespace

void add_streaming(py::module_& module) {
    module.def(
        "extract_file_to_file",
        [](const std::filesystem::path& scan, double isovalue, const std::filesystem::path& path,
           const std::optional<Vec3d>& spacing, std::size_t max_memory, bool closed, bool topology,
           const std::string& space, int threads, const py::object& progress) {
            return file_to_file(scan, spacing,
                                {isovalue, path, max_memory, closed, topology, space_named(space), threads},
                                progress);
        },
        py::arg("scan"), py::arg("isovalue"), py::arg("path"), py::kw_only(), py::arg("spacing"),
        py::arg("max_memory"), py::arg("closed"), py::arg("topology"), py::arg("space"), py::arg("threads"),
        py::arg("progress"));
    module.def(
        "extract_slices_to_file",
        [](const py::function& read, const std::array<std::int64_t, 3>& shape, const py::dtype& type,
           std::int64_t slices_at_once, const Vec3d& spacing, const Vec3d& origin, const Mat3d& direction,
           const std::array<double, 2>& rescale, double isovalue, const std::filesystem::path& path,
           std::size_t max_memory, bool closed, bool topology, const std::string& space, int threads,
           const py::object& progress) {
            const Geometry geometry{{shape[2], shape[1], shape[0]}, spacing, origin, direction};
            return slices_to_file(read, geometry, type, slices_at_once, {rescale[0], rescale[1]},
                                  {isovalue, path, max_memory, closed, topology, space_named(space), threads},
                                  progress);
        },
        py::arg("read"), py::arg("shape"), py::arg("dtype"), py::arg("slices_at_once"), py::arg("spacing"),
        py::arg("origin"), py::arg("direction"), py::arg("rescale"), py::arg("isovalue"), py::arg("path"),
        py::kw_only(), py::arg("max_memory"), py::arg("closed"), py::arg("topology"), py::arg("space"),
        py::arg("threads"), py::arg("progress"));
}

}  // namespace marrow::python
