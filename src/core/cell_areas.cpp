#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "cell_areas.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "case_table.h"
#include "cell_areas.h"
#include "dispatch.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Sums of one row, in single precision and padded to whole vectors.
struct RowSums {
    static constexpr std::size_t kSize = Levels::kMost + 16;
    alignas(64) float area[kSize] = {}, volume[kSize] = {};

    void move_to(CellSums& sums) {
        for (std::size_t k = 0; k < sums.area.size(); ++k) {
            sums.area[k] += static_cast<double>(area[k]);
            sums.volume[k] += static_cast<double>(volume[k]);
        }
        std::fill_n(area, kSize, 0.0f);
        std::fill_n(volume, kSize, 0.0f);
    }
};

// From so many isovalues in a row on it is quicker to let a cell's points move than to find them for each: half of the runs have one.
inline constexpr std::size_t kFewestMoves = 2;

// The edges of a cell, padded to whole vectors.
inline constexpr std::size_t kLanes = 16;

// Where a cell's edges start, about the cell's first corner, and their vectors.
struct EdgeFrame {
    alignas(64) float base[3][kLanes] = {};
    alignas(64) float along[3][kLanes] = {};

    explicit EdgeFrame(const Frame& frame) {
        for (std::size_t e = 0; e < kEdges; ++e) {
            const int first = kEdgeCorners[e][0], second = kEdgeCorners[e][1];
            const std::size_t axis = second - first == 1 ? 0 : second - first == 2 ? 1 : 2;
            for (std::size_t r = 0; r < 3; ++r) {
                along[r][e] = frame.matrix[r][axis];
                base[r][e] = frame.matrix[r][0] * static_cast<float>(first & 1) +
                             frame.matrix[r][1] * static_cast<float>(first >> 1 & 1) +
                             frame.matrix[r][2] * static_cast<float>(first >> 2);
            }
        }
    }
};

// The points on a cell's edges as they move with the isovalue: at + velocity * (isovalue - that of set_isovalue), where
// find_velocity has been called for the cell.
template <class R>
struct MovingPoints {
    alignas(64) float at[3][kLanes], velocity[3][kLanes];

    // For a cell at `corner`; `within`: bit v is set where corner v has a value. Where one end of an edge has none, its point
    // stays in the middle.
    HWY_INLINE void set_cell(const EdgeFrame& frame, const float (&corner)[3], const R (&value)[8],
                             unsigned within) {
        for (std::size_t e = 0; e < kEdges; ++e) first_[e] = value[kEdgeCorners[e][0]];
        for (std::size_t e = 0; e < kEdges; ++e) difference_[e] = value[kEdgeCorners[e][1]] - first_[e];
        for (std::size_t e = 0; e < kEdges; ++e) {
            const unsigned both = within >> kEdgeCorners[e][0] & within >> kEdgeCorners[e][1] & 1;
            usable_[e] = both != 0 && std::abs(difference_[e]) <= std::numeric_limits<R>::max() ? R(1) : R(0);
        }
        for (std::size_t r = 0; r < 3; ++r) {
            for (std::size_t e = 0; e < kLanes; ++e) start_[r][e] = corner[r] + frame.base[r][e];
        }
        moves_ = false;
    }
    HWY_INLINE void find_velocity(const EdgeFrame& frame) {
        if (moves_) return;
        moves_ = true;
        for (std::size_t e = 0; e < kLanes; ++e) {
            const float per_unit = static_cast<float>(usable_[e] != R(0) ? R(1) / difference_[e] : R(0));
            for (std::size_t r = 0; r < 3; ++r) velocity[r][e] = frame.along[r][e] * per_unit;
        }
    }
    HWY_INLINE void set_isovalue(const EdgeFrame& frame, R isovalue) {
        for (std::size_t e = 0; e < kLanes; ++e) {
            const R t = (isovalue - first_[e]) / difference_[e];
            const float fraction = static_cast<float>(usable_[e] != R(0) ? t : R(0.5));
            for (std::size_t r = 0; r < 3; ++r) at[r][e] = start_[r][e] + frame.along[r][e] * fraction;
        }
    }

  private:
    alignas(64) R first_[kLanes] = {}, difference_[kLanes] = {}, usable_[kLanes] = {};
    alignas(64) float start_[3][kLanes];
    bool moves_ = false;  // velocity is that of this cell
};

// Adds twice the area and six times the volume of a triangle between three points, for isovalue k alone.
template <class R>
HWY_INLINE void add_still_triangle(const MovingPoints<R>& points, const std::uint8_t* edges, std::size_t k,
                                   RowSums& sums) {
    float a[3], u[3], v[3];
    for (std::size_t r = 0; r < 3; ++r) {
        a[r] = points.at[r][edges[0]];
        u[r] = points.at[r][edges[1]] - a[r];
        v[r] = points.at[r][edges[2]] - a[r];
    }
    const float x = u[1] * v[2] - u[2] * v[1], y = u[2] * v[0] - u[0] * v[2], z = u[0] * v[1] - u[1] * v[0];
    sums.area[k] += std::sqrt(x * x + y * y + z * z);
    sums.volume[k] += x * a[0] + y * a[1] + z * a[2];
}

// The same between moving points, for isovalues [begin, end).
template <class R>
HWY_INLINE void add_moving_triangle(const MovingPoints<R>& points, const std::uint8_t* edges,
                                    const float* isovalues, std::size_t begin, std::size_t end,
                                    RowSums& sums) {
    // Its points are linear in the isovalue, so its edge vectors u and v are, and the normal u x v is quadratic.
    float a[3], a1[3], u[3], u1[3], v[3], v1[3];
    for (std::size_t r = 0; r < 3; ++r) {
        a[r] = points.at[r][edges[0]];
        a1[r] = points.velocity[r][edges[0]];
        u[r] = points.at[r][edges[1]] - a[r];
        u1[r] = points.velocity[r][edges[1]] - a1[r];
        v[r] = points.at[r][edges[2]] - a[r];
        v1[r] = points.velocity[r][edges[2]] - a1[r];
    }
    float n0[3], n1[3], n2[3];
    for (std::size_t r = 0; r < 3; ++r) {
        const std::size_t s = (r + 1) % 3, t = (r + 2) % 3;
        n0[r] = u[s] * v[t] - u[t] * v[s];
        n1[r] = u[s] * v1[t] - u[t] * v1[s] + (u1[s] * v[t] - u1[t] * v[s]);
        n2[r] = u1[s] * v1[t] - u1[t] * v1[s];
    }
    const hn::CappedTag<float, 8> d;
    const auto start = hn::Set(d, isovalues[begin]);
    for (std::size_t k = begin; k < end; k += hn::Lanes(d)) {
        const auto moved = hn::Sub(hn::LoadU(d, isovalues + k), start);
        auto squared = hn::Zero(d), volume = hn::Zero(d);
        for (std::size_t r = 0; r < 3; ++r) {
            // No fused operations, so that the numbers are the same on every processor.
            const auto slope = hn::Add(hn::Mul(hn::Set(d, n2[r]), moved), hn::Set(d, n1[r]));
            const auto n = hn::Add(hn::Mul(slope, moved), hn::Set(d, n0[r]));
            const auto corner = hn::Add(hn::Mul(hn::Set(d, a1[r]), moved), hn::Set(d, a[r]));
            squared = hn::Add(squared, hn::Mul(n, n));
            volume = hn::Add(volume, hn::Mul(n, corner));
        }
        const auto in_run = hn::FirstN(d, end - k);
        hn::StoreU(hn::Add(hn::LoadU(d, sums.area + k), hn::IfThenElseZero(in_run, hn::Sqrt(squared))), d,
                   sums.area + k);
        hn::StoreU(hn::Add(hn::LoadU(d, sums.volume + k), hn::IfThenElseZero(in_run, volume)), d,
                   sums.volume + k);
    }
}

template <class T>
void add_cells_of(const VolumeView& volume, const Frame& frame, const Levels& levels,
                  std::span<const double> isovalues, std::int64_t z, CellSums& sums) {
    using R = Real<T>;
    const auto [nx, ny, nz] = volume.geometry.dims;
    const EdgeFrame edges(frame);
    RowSums row_sums;
    const std::array<Case, 256>& cases = frame.mirrored ? kMirroredCases : kCases;

    // Isovalues on the samples' scale, and as far from the first.
    R isovalue[Levels::kMost];
    alignas(64) float distance[RowSums::kSize] = {};
    for (std::size_t k = 0; k < isovalues.size(); ++k) {
        isovalue[k] = static_cast<R>(isovalues[k]) * kSampleScale<T>;
        distance[k] =
            static_cast<float>((isovalues[k] - isovalues[0]) * static_cast<double>(kSampleScale<T>));
    }
    const Vec3d middle =
        volume.geometry.physical({0.5 * static_cast<double>(nx - 1), 0.5 * static_cast<double>(ny - 1),
                                  0.5 * static_cast<double>(nz - 1)});
    const std::vector<std::uint8_t> outside(static_cast<std::size_t>(levels.stride), 0);
    const auto width = static_cast<std::size_t>(levels.stride);
    std::vector<std::uint8_t> low(width), high(width), active(width);
    MovingPoints<R> points;

    for (std::int64_t row = -1; row < ny; ++row) {
        // The rows of samples at (row, z), (row + 1, z), (row, z + 1), (row + 1, z + 1).
        const std::uint8_t* level[4];
        const T* sample[4];
        for (std::int64_t r = 0; r < 4; ++r) {
            const std::int64_t sy = row + (r & 1), sz = z + (r >> 1);
            const bool within = sy >= 0 && sy < ny && sz >= 0 && sz < nz;
            level[r] = within ? levels.bytes.data() + (sz * ny + sy) * levels.stride : outside.data();
            sample[r] = within ? static_cast<const T*>(volume.data) + (sz * ny + sy) * nx : nullptr;
        }
        for (std::size_t i = 0; i < width; ++i) {
            low[i] = std::min(std::min(level[0][i], level[1][i]), std::min(level[2][i], level[3][i]));
            high[i] = std::max(std::max(level[0][i], level[1][i]), std::max(level[2][i], level[3][i]));
        }
        for (std::size_t i = 0; i + 1 < width; ++i)
            active[i] = std::max(high[i], high[i + 1]) != std::min(low[i], low[i + 1]);

        Vec3f base = frame.row_base(row, z);
        for (std::size_t r = 0; r < 3; ++r) {
            base[r] = static_cast<float>(frame.origin[r] - middle[r] +
                                         frame.exact[r][1] * static_cast<double>(row) +
                                         frame.exact[r][2] * static_cast<double>(z));
        }
        for (std::size_t i = 0; i + 1 < width; ++i) {
            if (i % 8 == 0 && i + 8 < width) {
                std::uint64_t eight;
                std::memcpy(&eight, active.data() + i, 8);
                if (eight == 0) {
                    i += 7;
                    continue;
                }
            }
            if (active[i] == 0) continue;
            // Level i belongs to sample i - 1.
            const std::int64_t cell_x = static_cast<std::int64_t>(i) - 1;
            std::uint64_t corner_levels = 0;
            R value[8];
            unsigned within = 0;
            for (unsigned v = 0; v < 8; ++v) {
                const unsigned r = v >> 1;
                const std::int64_t sx = cell_x + (v & 1);
                corner_levels |= std::uint64_t{level[r][i + (v & 1)]} << (8 * v);
                const bool has_value = sample[r] != nullptr && sx >= 0 && sx < nx;
                within |= unsigned{has_value} << v;
                value[v] = has_value ? static_cast<R>(sample[r][sx]) * kSampleScale<T> : R(0);
            }
            float corner[3];
            for (std::size_t r = 0; r < 3; ++r)
                corner[r] = base[r] + frame.matrix[r][0] * static_cast<float>(cell_x);
            points.set_cell(edges, corner, value, within);

            // From one corner's level to the next the case stays.
            const std::size_t last = std::max(high[i], high[i + 1]);
            for (std::size_t k = std::min(low[i], low[i + 1]), next = last; k < last; k = next) {
                next = last;
                for (unsigned v = 0; v < 8; ++v) {
                    const std::size_t l = corner_levels >> (8 * v) & 0xff;
                    if (l > k && l < next) next = l;
                }
                // A corner is inside surface k where its level is above k. Levels have seven bits, so the eighth of each
                // byte of a difference tells; a product gathers them.
                constexpr std::uint64_t kOnes = 0x0101010101010101u, kTops = 0x8080808080808080u;
                const std::uint64_t inside = ((corner_levels | kTops) - (k + 1) * kOnes) & kTops;
                const Case& c = cases[((inside >> 7) * 0x0102040810204080u) >> 56];
                if (next - k >= kFewestMoves) {
                    points.set_isovalue(edges, isovalue[k]);
                    points.find_velocity(edges);
                    for (std::size_t t = 0; t < c.triangles; ++t)
                        add_moving_triangle(points, c.edges.data() + 3 * t, distance, k, next, row_sums);
                } else {
                    for (std::size_t j = k; j < next; ++j) {
                        points.set_isovalue(edges, isovalue[j]);
                        for (std::size_t t = 0; t < c.triangles; ++t)
                            add_still_triangle(points, c.edges.data() + 3 * t, j, row_sums);
                    }
                }
                for (std::size_t j = k; j < next; ++j) sums.triangles[j] += c.triangles;
            }
        }
        row_sums.move_to(sums);
    }
}

void add_cells_any(const VolumeView& volume, const Frame& frame, const Levels& levels,
                   std::span<const double> isovalues, std::int64_t z, CellSums& sums) {
    with_sample_type(volume.type, [&](auto sample) {
        add_cells_of<decltype(sample)>(volume, frame, levels, isovalues, z, sums);
    });
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(add_cells_any);

void add_cells(const VolumeView& volume, const Frame& frame, const Levels& levels,
               std::span<const double> isovalues, std::int64_t z, CellSums& sums) {
    HWY_DYNAMIC_DISPATCH(add_cells_any)(volume, frame, levels, isovalues, z, sums);
}

}  // namespace marrow::internal
#endif
