// What scikit-image's marching_cubes returns beyond an isosurface: another winding, and a value for each point.
#include <pybind11/numpy.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <utility>

#include <marrow/error.h>
#include <marrow/isosurface.h>

#include "long_work.h"
#include "mesh.h"
#include "module.h"
#include "volume.h"

namespace py = pybind11;

namespace marrow::python {

namespace {

// An edge of the grid: from sample `first` to the next one along `axis`.
struct GridEdge {
    std::array<std::int64_t, 3> first;
    std::size_t axis;
};

// Finds the edges on which points lie, in a volume whose index axes are parallel to axes of space.
class EdgeFinder {
  public:
    explicit EdgeFinder(const Geometry& geometry) : dims_(geometry.dims) {
        for (std::size_t m = 0; m < 3; ++m) {
            row_[m] = 0;
            for (std::size_t row = 1; row < 3; ++row)
                if (std::abs(geometry.direction[row][m]) > std::abs(geometry.direction[row_[m]][m]))
                    row_[m] = row;
            scale_[m] = 1 / (geometry.direction[row_[m]][m] * geometry.spacing[m]);
            offset_[m] = -geometry.origin[row_[m]] * scale_[m];
        }
    }

    /// Two of the point's indices are integers, but for rounding; the edge runs along the third axis. For points that
    /// snapping has moved off the edges, it is a nearby edge.
    GridEdge edge_of(const Vec3f& point) const {
        GridEdge edge{{}, 0};
        std::array<double, 3> fraction{};
        std::int64_t along = 0;
        for (std::size_t m = 0; m < 3; ++m) {
            const double index = point[row_[m]] * scale_[m] + offset_[m];
            const std::int64_t nearest = below(index + 0.5);
            edge.first[m] = std::clamp(nearest, std::int64_t{0}, dims_[m] - 1);
            fraction[m] = std::abs(index - static_cast<double>(nearest));
            if (fraction[m] >= fraction[edge.axis]) {
                edge.axis = m;
                along = below(index);
            }
        }
        edge.first[edge.axis] = std::clamp(along, std::int64_t{0}, dims_[edge.axis] - 2);
        return edge;
    }

  private:
    // The largest integer that is not greater, for indices, which are at least -1; std::floor would be a call.
    static std::int64_t below(double index) { return static_cast<std::int64_t>(index + 1) - 1; }

    std::array<std::int64_t, 3> dims_;
    std::array<std::size_t, 3> row_{};  // the axis of space along which index axis m runs
    std::array<double, 3> scale_{}, offset_{};
};

// The largest difference between samples of a cell, of the cells around an edge. `step` is the distance in samples between
// neighbours along each axis. NaN counts as the sample before it.
template <std::size_t along, class T>
float largest_range(const T* samples, const std::array<std::int64_t, 3>& dims,
                    const std::array<std::int64_t, 3>& step, const GridEdge& edge) {
    // Single precision holds differences of 16-bit samples; its minimum and maximum are one instruction each.
    using Number = std::conditional_t<sizeof(T) <= 2 || std::is_same_v<T, float>, float, double>;
    constexpr std::size_t u = along == 0 ? 1 : 0, v = along == 2 ? 1 : 2;
    // Beyond the border the nearest samples stand in: a cell of them has no larger range than the one beside it.
    const auto neighbours = [&](std::size_t axis) {
        const std::int64_t i = edge.first[axis];
        return std::array{i > 0 ? -step[axis] : 0, std::int64_t{0}, i + 1 < dims[axis] ? step[axis] : 0};
    };
    const std::array<std::int64_t, 3> at_u = neighbours(u), at_v = neighbours(v);
    const T* start = samples + edge.first[0] + edge.first[1] * step[1] + edge.first[2] * step[2];
    const std::int64_t next = along == 0 ? 1 : step[along];
    Number low[3][3], high[3][3];  // of the two samples of each edge that is parallel to this one
    for (std::size_t l = 0; l < 3; ++l) {
        for (std::size_t k = 0; k < 3; ++k) {
            const T* first = start + at_u[k] + at_v[l];
            const auto a = static_cast<Number>(first[0]), b = static_cast<Number>(first[next]);
            low[l][k] = std::min(a, b);
            high[l][k] = std::max(a, b);
        }
    }
    Number largest = 0;
    for (std::size_t k = 0; k < 2; ++k) {
        Number bottom[3], top[3];
        for (std::size_t l = 0; l < 3; ++l) {
            bottom[l] = std::min(low[l][k], low[l][k + 1]);
            top[l] = std::max(high[l][k], high[l][k + 1]);
        }
        for (std::size_t l = 0; l < 2; ++l)
            largest = std::max(largest, std::max(top[l], top[l + 1]) - std::min(bottom[l], bottom[l + 1]));
    }
    return static_cast<float>(largest);
}

void find_values(const VolumeView& volume, const Buffer<Vec3f>& points, int threads, const Progress& progress,
                 float* values) {
    const EdgeFinder finder(volume.geometry);
    const std::array<std::int64_t, 3>& dims = volume.geometry.dims;
    const std::array<std::int64_t, 3> step{1, dims[0], dims[0] * dims[1]};
    tbb::task_arena arena(threads > 0 ? threads : tbb::task_arena::automatic);
    visit_sample_type(volume.type, [&](auto sample) {
        const auto* samples = static_cast<const decltype(sample)*>(volume.data);
        arena.execute([&] {
            constexpr std::size_t kGrain = 16384;
            tbb::parallel_for(
                tbb::blocked_range<std::size_t>(0, points.size(), kGrain), [&](const auto& range) {
                    if (!progress(1)) throw Cancelled();
                    for (std::size_t i = range.begin(); i != range.end(); ++i) {
                        const GridEdge edge = finder.edge_of(points[i]);
                        values[i] = edge.axis == 0   ? largest_range<0>(samples, dims, step, edge)
                                    : edge.axis == 1 ? largest_range<1>(samples, dims, step, edge)
                                                     : largest_range<2>(samples, dims, step, edge);
                    }
                });
        });
    });
}

py::tuple marching_cubes(const ArrayVolume& volume, double isovalue, bool inward, bool closed, double snap,
                         int threads, const py::object& progress) {
    Mesh mesh;
    auto values = std::make_unique<Buffer<float>>();
    run_long_work(progress, [&](const Progress& report) {
        mesh = extract_isosurface(volume.view(), isovalue,
                                  {.closed = closed, .snap = snap, .threads = threads, .progress = report});
        if (inward)
            for (auto& triangle : mesh.triangles) std::swap(triangle[0], triangle[2]);
        values->resize(mesh.points.size());
        find_values(volume.view(), mesh.points, threads, report, values->data());
    });
    const py::tuple arrays = to_python(std::move(mesh));
    const py::capsule owner(values.get(), [](void* p) { delete static_cast<Buffer<float>*>(p); });
    const Buffer<float>& numbers = *values.release();
    return py::make_tuple(
        arrays[0], arrays[1], arrays[2],
        py::array_t<float>(static_cast<py::ssize_t>(numbers.size()), numbers.data(), owner));
}

}  // namespace

void add_scikit_image(py::module_& module) {
    module.def("marching_cubes", &marching_cubes, py::arg("volume"), py::arg("isovalue"), py::kw_only(),
               py::arg("inward"), py::arg("closed"), py::arg("snap"), py::arg("threads"),
               py::arg("progress"));
}

}  // namespace marrow::python
