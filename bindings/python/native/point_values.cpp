// For each point, the largest range of the samples of a cell at its edge. The work is the same for each edge
// and goes in batches, in plain loops that the compiler makes vectors of, once for each SIMD target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "point_values.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <type_traits>

#include "point_values.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::python::HWY_NAMESPACE {

// The edges of a batch.
constexpr std::size_t kBatch = 256;

// Some edges of the grid: edge i goes from sample `first[0..2][i]` to the next one along axis[i].
struct GridEdges {
    std::int32_t first[3][kBatch];
    std::int32_t axis[kBatch];
};

// By value, unlike std::min and std::max, so that loops of them become vectors.
template <class T>
HWY_INLINE T smaller(T a, T b) {
    return b < a ? b : a;
}
template <class T>
HWY_INLINE T larger(T a, T b) {
    return a < b ? b : a;
}

// The largest integer that is not greater, for indices, which are at least -1; std::floor would be a call.
HWY_INLINE std::int32_t below(double index) {
    return static_cast<std::int32_t>(index + 1) - 1;
}

// Finds the edges on which points lie. Two of a point's indices are integers, but for rounding; the edge runs
// along the third axis. For points that are on no edge it is a nearby one.
void find_edges(const IndexMapping& mapping, const Vec3f* points, std::size_t count, GridEdges& edges) {
    std::int32_t nearest[3][kBatch];
    std::int32_t along[3][kBatch];  // where the edge starts if it runs along this axis
    float fraction[3][kBatch];      // the distance from the nearest integer
    for (std::size_t m = 0; m < 3; ++m) {
        const std::size_t axis = mapping.axis[m];
        const double scale = mapping.scale[m], offset = mapping.offset[m];
        const auto last = static_cast<std::int32_t>(mapping.dims[m] - 1);
        double index[kBatch] = {};
        for (std::size_t i = 0; i < count; ++i) index[i] = points[i][axis] * scale + offset;
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

// The samples around some edges: [v][u][end][edge]. The edge itself runs between the ends of [1][1], and [0]
// and [2] lie before and after it along the other axes, u and v.
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

    // Asks for the rows around the edges in the next slice; edges before these have
    // read those of the other slices.
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

    // The distances in memory to the samples before and after along an axis. Beyond the border the nearest
    // sample stands in: a cell of such samples has no larger range than the one beside it.
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
    std::fill_n(ranges, kBatch, 0.0F);
    for (std::size_t l = 0; l < 2; ++l) {
        for (std::size_t k = 0; k < 2; ++k) {
            for (std::size_t i = 0; i < kBatch; ++i) {
                const T bottom = smaller(low[l][k][i], low[l + 1][k][i]);
                const T top = larger(high[l][k][i], high[l + 1][k][i]);
                const auto range = static_cast<float>(static_cast<Number>(top) - static_cast<Number>(bottom));
                ranges[i] = larger(ranges[i], range);
            }
        }
    }
}

template <class T>
void find_values(const VolumeView& volume, const IndexMapping& mapping, const Vec3f* points,
                 std::size_t count, float* values) {
    const Grid<T> grid(volume);
    Samples<T> samples{};
    GridEdges edges;
    float ranges[kBatch];
    for (std::size_t begin = 0; begin < count; begin += kBatch) {
        const std::size_t batch = std::min(kBatch, count - begin);
        find_edges(mapping, points + begin, batch, edges);
        grid.prefetch(edges, batch);
        grid.gather(edges, batch, samples);
        replace_nan(samples);
        find_largest_ranges(samples, ranges);
        std::copy_n(ranges, batch, values + begin);
    }
}

void find_values_any(const VolumeView& volume, const IndexMapping& mapping, const Vec3f* points,
                     std::size_t count, float* values) {
    visit_sample_type(volume.type, [&](auto sample) HWY_ATTR {
        find_values<decltype(sample)>(volume, mapping, points, count, values);
    });
}

}  // namespace marrow::python::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::python {

HWY_EXPORT(find_values_any);

void find_point_values(const VolumeView& volume, const IndexMapping& mapping, const Vec3f* points,
                       std::size_t count, float* values) {
    HWY_DYNAMIC_DISPATCH(find_values_any)(volume, mapping, points, count, values);
}

}  // namespace marrow::python
#endif  // HWY_ONCE
