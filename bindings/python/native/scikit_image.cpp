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
#include <vector>

#include <marrow/error.h>
#include <marrow/isosurface.h>

#include "long_work.h"
#include "mesh.h"
#include "module.h"
#include "volume.h"

namespace py = pybind11;

namespace marrow::python {

namespace {

// Values are found for this many points at a time, in loops that the compiler makes vectors of.
constexpr std::size_t kBatch = 256;

// Some edges of the grid: edge i goes from sample `first[0..2][i]` to the next one along axis[i].
struct GridEdges {
    std::int32_t first[3][kBatch];
    std::int32_t axis[kBatch];
};

// By value, unlike std::min and std::max, so that loops of them become vectors.
template <class T>
T smaller(T a, T b) {
    return b < a ? b : a;
}
template <class T>
T larger(T a, T b) {
    return a < b ? b : a;
}

// Finds the edges and cells in which points lie, in a volume whose index axes are parallel to axes of space.
class IndexFinder {
  public:
    explicit IndexFinder(const Geometry& geometry) : dims_(geometry.dims) {
        for (std::size_t m = 0; m < 3; ++m) {
            row_[m] = 0;
            for (std::size_t row = 1; row < 3; ++row)
                if (std::abs(geometry.direction[row][m]) > std::abs(geometry.direction[row_[m]][m]))
                    row_[m] = row;
            scale_[m] = 1 / (geometry.direction[row_[m]][m] * geometry.spacing[m]);
            offset_[m] = -geometry.origin[row_[m]] * scale_[m];
        }
    }

    /// Two of a point's indices are integers, but for rounding; the edge runs along the third axis. For points that
    /// snapping has moved off the edges, and for those within a cell, it is a nearby edge.
    void find_edges(const Vec3f* points, std::size_t count, GridEdges& edges) const {
        std::int32_t nearest[3][kBatch];
        std::int32_t along[3][kBatch];  // where the edge starts if it runs along this axis
        float fraction[3][kBatch];      // the distance from the nearest integer
        for (std::size_t m = 0; m < 3; ++m) {
            const auto last = static_cast<std::int32_t>(dims_[m] - 1);
            double index[kBatch] = {};
            for (std::size_t i = 0; i < count; ++i) index[i] = points[i][row_[m]] * scale_[m] + offset_[m];
            for (std::size_t i = 0; i < kBatch; ++i) {
                const std::int32_t integer = below(index[i] + 0.5);
                along[m][i] = smaller(larger(below(index[i]), 0), last - 1);
                nearest[m][i] = smaller(larger(integer, 0), last);
                fraction[m][i] = static_cast<float>(std::abs(index[i] - integer));
            }
        }
        for (std::size_t i = 0; i < kBatch; ++i) {
            const float most = larger(fraction[0][i], larger(fraction[1][i], fraction[2][i]));
            const std::int32_t before_z = fraction[1][i] == most ? 1 : 0;
            edges.axis[i] = fraction[2][i] == most ? 2 : before_z;
        }
        for (std::int32_t m = 0; m < 3; ++m) {
            for (std::size_t i = 0; i < kBatch; ++i) {
                const std::int32_t a = along[m][i], b = nearest[m][i];
                edges.first[m][i] = edges.axis[i] == m ? a : b;
            }
        }
    }

    /// The lowest sample of the cell around a position.
    std::array<std::int64_t, 3> cell_of(const Vec3d& position) const {
        std::array<std::int64_t, 3> cell{};
        for (std::size_t m = 0; m < 3; ++m)
            cell[m] =
                std::clamp<std::int64_t>(below(position[row_[m]] * scale_[m] + offset_[m]), 0, dims_[m] - 2);
        return cell;
    }

  private:
    // The largest integer that is not greater, for indices, which are at least -1; std::floor would be a call.
    static std::int32_t below(double index) { return static_cast<std::int32_t>(index + 1) - 1; }

    std::array<std::int64_t, 3> dims_;
    std::array<std::size_t, 3> row_{};  // the axis of space along which index axis m runs
    std::array<double, 3> scale_{}, offset_{};
};

// The samples around some edges: [v][u][end][edge]. The edge itself runs between the ends of [1][1], and [0] and [2] lie
// before and after it along the other axes, u and v. So the work on many edges is the same, and the compiler makes vectors
// of it: one by one, values took as long as all the rest.
template <class T>
using Samples = T[3][3][2][kBatch];

// The samples of a volume.
template <class T>
class Grid {
  public:
    explicit Grid(const VolumeView& volume)
        : first_(static_cast<const T*>(volume.data)),
          dims_(volume.geometry.dims),
          step_{1, volume.row_pitch(), volume.slice_pitch()} {}

    // The samples around the first `count` edges.
    void gather(const GridEdges& edges, std::size_t count, Samples<T>& to) const {
        for (std::size_t i = 0; i < count; ++i) {
            const auto axis = static_cast<std::size_t>(edges.axis[i]);
            const std::size_t u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
            const T* middle = at(edges, i);
            const std::int64_t next = step_[axis];
            const std::array<std::int64_t, 2> at_u = neighbours(edges, i, u), at_v = neighbours(edges, i, v);
            for (std::size_t l = 0; l < 3; ++l) {
                const T* row = l == 1 ? middle : middle + at_v[l / 2];
                const T* const samples[3] = {row + at_u[0], row, row + at_u[1]};
                for (std::size_t k = 0; k < 3; ++k) {
                    to[l][k][0][i] = samples[k][0];
                    to[l][k][1][i] = samples[k][next];
                }
            }
        }
    }

    // Asks for the rows around the edges in the next slice; edges before these have read those of the other slices.
    void prefetch(const GridEdges& edges, std::size_t count) const {
        for (std::size_t i = 0; i < count; ++i) {
            const T* next = at(edges, i) + (edges.first[2][i] + 1 < dims_[2] ? step_[2] : 0);
            for (const std::int64_t row : neighbours(edges, i, 1)) __builtin_prefetch(next + row);
        }
    }

  private:
    const T* at(const GridEdges& edges, std::size_t i) const {
        return first_ + edges.first[0][i] + edges.first[1][i] * step_[1] + edges.first[2][i] * step_[2];
    }

    // The distances in memory to the samples before and after along an axis. Beyond the border the nearest sample stands
    // in: a cell of such samples has no larger range than the one beside it.
    std::array<std::int64_t, 2> neighbours(const GridEdges& edges, std::size_t i, std::size_t axis) const {
        const std::int64_t index = edges.first[axis][i];
        return {index > 0 ? -step_[axis] : 0, index + 1 < dims_[axis] ? step_[axis] : 0};
    }

    const T* first_;
    std::array<std::int64_t, 3> dims_, step_;
};

// Lets an end of the edge itself stand in for NaN. At least one of them is a number.
template <class T>
void replace_nan(Samples<T>& samples) {
    if constexpr (std::is_floating_point_v<T>) {
        for (std::size_t i = 0; i < kBatch; ++i) {
            const T number =
                samples[1][1][0][i] == samples[1][1][0][i] ? samples[1][1][0][i] : samples[1][1][1][i];
            for (auto& row : samples)
                for (auto& ends : row)
                    for (auto& end : ends) end[i] = end[i] == end[i] ? end[i] : number;
        }
    }
}

// For each edge, the largest range of the samples of a cell, of the four cells around it.
template <class T>
void find_largest_ranges(const Samples<T>& samples, float* ranges) {
    // Single precision holds differences of 16-bit samples.
    using Number = std::conditional_t<sizeof(T) <= 2 || std::is_same_v<T, float>, float, double>;
    T low[3][2][kBatch], high[3][2][kBatch];  // of the pairs of neighbours along u
    for (std::size_t l = 0; l < 3; ++l) {
        for (std::size_t k = 0; k < 2; ++k) {
            const auto &a = samples[l][k][0], &b = samples[l][k][1], &c = samples[l][k + 1][0],
                       &d = samples[l][k + 1][1];
            for (std::size_t i = 0; i < kBatch; ++i) {
                low[l][k][i] = smaller(smaller(a[i], b[i]), smaller(c[i], d[i]));
                high[l][k][i] = larger(larger(a[i], b[i]), larger(c[i], d[i]));
            }
        }
    }
    float largest[kBatch] = {};
    for (std::size_t l = 0; l < 2; ++l) {
        for (std::size_t k = 0; k < 2; ++k) {
            for (std::size_t i = 0; i < kBatch; ++i) {
                const T bottom = smaller(low[l][k][i], low[l + 1][k][i]);
                const T top = larger(high[l][k][i], high[l + 1][k][i]);
                const auto range = static_cast<float>(static_cast<Number>(top) - static_cast<Number>(bottom));
                largest[i] = larger(largest[i], range);
            }
        }
    }
    std::copy_n(largest, kBatch, ranges);
}

void find_values(const VolumeView& volume, const Buffer<Vec3f>& points, int threads, const Progress& progress,
                 float* values) {
    const IndexFinder finder(volume.geometry);
    tbb::task_arena arena(threads > 0 ? threads : tbb::task_arena::automatic);
    visit_sample_type(volume.type, [&](auto type) {
        const Grid<decltype(type)> grid(volume);
        arena.execute([&] {
            constexpr std::size_t kGrain = 64 * kBatch;
            tbb::parallel_for(
                tbb::blocked_range<std::size_t>(0, points.size(), kGrain), [&](const auto& range) {
                    if (!progress(1)) throw Cancelled();
                    Samples<decltype(type)> samples{};
                    float ranges[kBatch];
                    GridEdges edges;
                    for (std::size_t first = range.begin(); first < range.end(); first += kBatch) {
                        const std::size_t count = std::min(kBatch, range.end() - first);
                        finder.find_edges(&points[first], count, edges);
                        grid.prefetch(edges, count);
                        grid.gather(edges, count, samples);
                        replace_nan(samples);
                        find_largest_ranges(samples, ranges);
                        std::copy_n(ranges, count, values + first);
                    }
                });
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

// Keeps the triangles of cells whose eight samples are not 0 in the mask, and their points. The cells that are left also
// decide the values.
void keep_masked(const VolumeView& volume, const VolumeView& mask, Mesh& mesh, Buffer<float>& values) {
    const IndexFinder in_volume(volume.geometry), in_mask(mask.geometry);
    std::fill(values.begin(), values.end(), -1.0F);  // the point is not used
    std::size_t kept = 0;
    for (const Triangle& triangle : mesh.triangles) {
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

py::tuple marching_cubes(const ArrayVolume& volume, double isovalue, const ArrayVolume* mask, bool inward,
                         bool closed, double snap, bool topology, int threads, const py::object& progress) {
    Mesh mesh;
    auto values = std::make_unique<Buffer<float>>();
    run_long_work(progress, [&](const Progress& report) {
        mesh = extract_isosurface(
            volume.view(), isovalue,
            {.closed = closed, .snap = snap, .topology = topology, .threads = threads, .progress = report});
        if (inward)
            for (auto& triangle : mesh.triangles) std::swap(triangle[0], triangle[2]);
        values->resize(mesh.points.size());
        if (mask != nullptr)
            keep_masked(volume.view(), mask->view(), mesh, *values);
        else
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
               py::arg("mask"), py::arg("inward"), py::arg("closed"), py::arg("snap"), py::arg("topology"),
               py::arg("threads"), py::arg("progress"));
}

}  // namespace marrow::python
