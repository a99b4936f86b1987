// What scikit-image's marching_cubes returns beyond an isosurface: another
// winding, and a value for each point.
#include <pybind11/numpy.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include <marrow/error.h>
#include <marrow/isosurface.h>

#include "index_mapping.h"
#include "long_work.h"
#include "mesh.h"
#include "module.h"
#include "point_values.h"
#include "volume.h"

namespace py = pybind11;

namespace marrow::python {

namespace {

// The values of all points, on some threads.
void find_values(const VolumeView& volume, const Buffer<Vec3f>& points, int threads, const Progress& progress,
                 float* values) {
    constexpr std::size_t kGrain = 1 << 14;
    const IndexMapping mapping(volume.geometry);
    // oneTBB prints a warning if an arena has more threads than the machine, and fails if it has very many.
    const int most = tbb::this_task_arena::max_concurrency();
    tbb::task_arena arena(threads > 0 ? std::min(threads, most) : most);
    arena.execute([&] {
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, points.size(), kGrain), [&](const auto& range) {
            if (!progress(1)) throw Cancelled();
            find_point_values(volume, mapping, &points[range.begin()], range.size(), values + range.begin());
        });
    });
}

// The lowest and the highest sample of a cell. NaN counts for neither.
std::pair<double, double> cell_range(const VolumeView& volume, const std::array<std::int64_t, 3>& cell) {
    return visit_sample_type(volume.type, [&](auto type) {
        const auto* first = static_cast<const decltype(type)*>(volume.data) + cell[0] +
                            cell[1] * volume.row_pitch() + cell[2] * volume.slice_pitch();
        constexpr double kInfinity = std::numeric_limits<double>::infinity();
        std::pair<double, double> range{kInfinity, -kInfinity};
        for (const std::int64_t z : {std::int64_t{0}, volume.slice_pitch()}) {
            for (const std::int64_t y : {std::int64_t{0}, volume.row_pitch()}) {
                for (const std::int64_t x : {0, 1}) {
                    const auto sample = static_cast<double>(first[z + y + x]);
                    if (sample < range.first) range.first = sample;
                    if (sample > range.second) range.second = sample;
                }
            }
        }
        return range;
    });
}

// Keeps the triangles of cells whose eight samples are not 0 in the mask, and their points. The cells that
// are left also decide the values. \throw Cancelled
void keep_masked(const VolumeView& volume, const VolumeView& mask, const Progress& report, Mesh& mesh,
                 Buffer<float>& values) {
    const IndexMapping in_volume(volume.geometry), in_mask(mask.geometry);
    std::fill(values.begin(), values.end(), -1.0F);  // the point is not used
    constexpr std::size_t kTogether = 65536;         // between two chances to cancel
    std::size_t kept = 0, seen = 0;
    for (const Triangle& triangle : mesh.triangles) {
        if (++seen % kTogether == 0 && !report(1)) throw Cancelled();
        Vec3d centre{0, 0, 0};  // never in a face of its cell: a triangle has no area in one
        for (const std::uint32_t point : triangle)
            for (std::size_t m = 0; m < 3; ++m) centre[m] += mesh.points[point][m] / 3.0;
        if (cell_range(mask, in_mask.cell_of(centre)).first == 0) continue;
        const auto [low, high] = cell_range(volume, in_volume.cell_of(centre));
        for (const std::uint32_t point : triangle)
            values[point] = std::max(values[point], static_cast<float>(high - low));
        mesh.triangles[kept++] = triangle;
    }
    mesh.triangles.resize(kept);
    std::vector<std::uint32_t> number(mesh.points.size());
    std::uint32_t used = 0;
    for (std::size_t i = 0; i < number.size(); ++i) {
        if (values[i] < 0) continue;
        mesh.points[used] = mesh.points[i];
        mesh.normals[used] = mesh.normals[i];
        values[used] = values[i];
        number[i] = used++;
    }
    mesh.points.resize(used);
    mesh.normals.resize(used);
    values.resize(used);
    for (Triangle& triangle : mesh.triangles)
        for (std::uint32_t& point : triangle) point = number[point];
}

// The last of the tuple is whether all samples are finite.
py::tuple marching_cubes(const ArrayVolume& volume, double isovalue, const ArrayVolume* mask, bool inward,
                         bool closed, double snap, bool topology, int threads, const py::object& progress) {
    Mesh mesh;
    IsosurfaceStats stats;
    auto values = std::make_unique<Buffer<float>>();
    run_long_work(progress, [&](const Progress& report) {
        mesh = extract_isosurface(
            volume.view(), isovalue,
            {.closed = closed, .snap = snap, .topology = topology, .threads = threads, .progress = report},
            &stats);
        if (inward)
            for (auto& triangle : mesh.triangles) std::swap(triangle[0], triangle[2]);
        values->resize(mesh.points.size());
        if (mask != nullptr)
            keep_masked(volume.view(), mask->view(), report, mesh, *values);
        else
            find_values(volume.view(), mesh.points, threads, report, values->data());
    });
    const py::tuple arrays = to_python(std::move(mesh));
    const py::capsule owner(values.get(), [](void* p) { delete static_cast<Buffer<float>*>(p); });
    const Buffer<float>& numbers = *values.release();
    return py::make_tuple(arrays[0], arrays[1], arrays[2],
                          py::array_t<float>(static_cast<py::ssize_t>(numbers.size()), numbers.data(), owner),
                          stats.non_finite_samples == 0);
}

}  // namespace

void add_scikit_image(py::module_& module) {
    module.def("marching_cubes", &marching_cubes, py::arg("volume"), py::arg("isovalue"), py::kw_only(),
               py::arg("mask"), py::arg("inward"), py::arg("closed"), py::arg("snap"), py::arg("topology"),
               py::arg("threads"), py::arg("progress"));
}

}  // namespace marrow::python
