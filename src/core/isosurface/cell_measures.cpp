// Finds the cells of a slice that isovalues cross, batches them by case, and measures eight at a time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/isosurface/cell_measures.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>

#include "cell_measures.h"
#include "core/marching_cubes/case_table.h"
#include "core/volume/rows.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Up to eight cells of one case, each with one isovalue.
template <class R>
struct Batch {
    static constexpr std::size_t kSize = 8;

    alignas(64) R corner[8][kSize];  // the samples minus the isovalue; infinite if there is no sample
    std::uint8_t isovalue[kSize];    // index of the isovalue
    std::size_t size = 0;
};

// Measures the cells of a slice in index space, where every point lies on an axis-parallel edge, and maps the
// results to physical space: areas by the length of the mapped normal, volumes by the determinant.
template <class R>
class SliceSums {
  public:
    SliceSums(const Mat3d& matrix, CellMeasures& sums) : sums_(sums) {
        const Mat3d cofactor = cofactors(matrix);
        for (std::size_t e = 0; e < kCellEdges; ++e) {
            const int first = kEdgeCorners[e][0], axis = kEdgeCorners[e][1] - first;
            for (int r = 0; r < 3; ++r)
                at_[e][r] = axis == 1 << r ? along_[e] : (first >> r & 1) != 0 ? ones_ : zeros_;
        }
        std::fill(zeros_, std::end(zeros_), R(0));
        std::fill(ones_, std::end(ones_), R(1));
        to_volume_ = std::abs(dot(matrix[0], cofactor[0]));
        double longest = 0;
        for (std::size_t a = 0; a < 3; ++a)
            longest = std::max(longest, dot(column(cofactor, a), column(cofactor, a)));
        int exponent = 0;
        std::frexp(std::sqrt(longest), &exponent);
        to_area_ = std::ldexp(1.0, exponent);
        for (std::size_t a = 0; a < 3; ++a) {
            for (std::size_t b = 0; b < 3; ++b) {
                const double product =
                    std::ldexp(dot(column(cofactor, a), column(cofactor, b)), -2 * exponent);
                square_[a][b] = static_cast<R>(a == b ? product : 2 * product);
            }
        }
    }

    // Adds a cell whose corners have these values. Values and isovalue are multiplied by kSampleScale.
    HWY_INLINE void add(std::uint8_t cell_case, const R (&value)[8], R isovalue, std::size_t k) {
        Batch<R>& batch = batches_[cell_case];
        for (std::size_t v = 0; v < 8; ++v) batch.corner[v][batch.size] = value[v] - isovalue;
        batch.isovalue[batch.size] = static_cast<std::uint8_t>(k);
        if (++batch.size == Batch<R>::kSize) flush(cell_case);
    }
    void flush() {
        for (std::size_t c = 0; c < batches_.size(); ++c) {
            if (batches_[c].size > 0) flush(c);
        }
    }

  private:
    HWY_NOINLINE void flush(std::size_t cell_case) {
        const hn::CappedTag<R, Batch<R>::kSize> d;
        constexpr std::size_t kSize = Batch<R>::kSize;
        Batch<R>& batch = batches_[cell_case];
        const Case& c = kCases[cell_case];
        const auto half = hn::Set(d, R(0.5)), least = hn::Set(d, R(kLeastFraction)),
                   most = hn::Set(d, std::numeric_limits<R>::max());
        alignas(64) R twice_area[kSize], six_volumes[kSize], facing_z[kSize];
        for (std::size_t i = 0; i < kSize; i += hn::Lanes(d)) {
            for (std::size_t e = 0; e < kCellEdges; ++e) {
                if ((c.crossed >> e & 1) == 0) continue;
                // Halved, as the difference of the largest numbers is none.
                const auto corner = [&](std::size_t end) {
                    return hn::Mul(half, hn::Load(d, batch.corner[kEdgeCorners[e][end]] + i));
                };
                const auto from = corner(0), difference = hn::Sub(from, corner(1));
                // As edge_fraction: if one end has no value, the point is in the middle.
                const auto t = hn::Div(from, difference);
                const auto usable = hn::And(hn::Le(hn::Abs(difference), most), hn::Eq(t, t));
                const auto within = hn::Min(hn::Max(t, least), hn::Sub(hn::Set(d, R(1)), least));
                hn::Store(hn::IfThenElse(usable, within, half), d, along_[e] + i);
            }
            auto area = hn::Zero(d), volume = hn::Zero(d), facing = hn::Zero(d);
            for (std::size_t t = 0; t < c.triangles; ++t) {
                const std::uint8_t* edges = c.edges.data() + 3 * t;
                const auto corner = [&](std::size_t n, std::size_t r) {
                    return hn::Load(d, at_[edges[n]][r] + i);
                };
                const auto ax = corner(0, 0), ay = corner(0, 1), az = corner(0, 2), bz = corner(1, 2),
                           cz = corner(2, 2);
                const auto ux = hn::Sub(corner(1, 0), ax), uy = hn::Sub(corner(1, 1), ay),
                           uz = hn::Sub(bz, az);
                const auto vx = hn::Sub(corner(2, 0), ax), vy = hn::Sub(corner(2, 1), ay),
                           vz = hn::Sub(cz, az);
                // The normal, twice as long as the area. No fused operations, so that results are the same on
                // every processor.
                const auto nx = hn::Sub(hn::Mul(uy, vz), hn::Mul(uz, vy)),
                           ny = hn::Sub(hn::Mul(uz, vx), hn::Mul(ux, vz)),
                           nz = hn::Sub(hn::Mul(ux, vy), hn::Mul(uy, vx));
                const auto by_x = hn::Add(
                    hn::Add(hn::Mul(hn::Set(d, square_[0][0]), nx), hn::Mul(hn::Set(d, square_[0][1]), ny)),
                    hn::Mul(hn::Set(d, square_[0][2]), nz));
                const auto by_y =
                    hn::Add(hn::Mul(hn::Set(d, square_[1][1]), ny), hn::Mul(hn::Set(d, square_[1][2]), nz));
                const auto by_z = hn::Mul(hn::Set(d, square_[2][2]), nz);
                const auto squared =
                    hn::Add(hn::Add(hn::Mul(by_x, nx), hn::Mul(by_y, ny)), hn::Mul(by_z, nz));
                area = hn::Add(area, hn::Sqrt(hn::Max(squared, hn::Zero(d))));
                // By the divergence theorem, the flux of (0, 0, z) through the surface is the volume. Here z
                // begins at the slice.
                volume = hn::Add(volume, hn::Mul(nz, hn::Add(hn::Add(az, bz), cz)));
                facing = hn::Add(facing, nz);
            }
            hn::Store(area, d, twice_area + i);
            hn::Store(volume, d, six_volumes + i);
            hn::Store(facing, d, facing_z + i);
        }
        for (std::size_t n = 0; n < batch.size; ++n) {
            const std::size_t k = batch.isovalue[n];
            sums_.twice_area[k] += static_cast<double>(twice_area[n]) * to_area_;
            sums_.six_volumes[k] += static_cast<double>(six_volumes[n]) * to_volume_;
            sums_.facing_z[k] += static_cast<double>(facing_z[n]) * to_volume_;
            sums_.triangles[k] += c.triangles;
        }
        batch.size = 0;
    }

    CellMeasures& sums_;
    double to_volume_;
    // The squared length of a normal n in physical space is the sum over a <= b of square_[a][b] n[a] n[b].
    // Its unit is to_area_, a power of two, so that R holds the squares for every spacing.
    R square_[3][3];
    double to_area_;
    std::array<Batch<R>, 256> batches_;
    // The position of each point along its edge. Each coordinate of a point is that, 0, or 1: at_ refers to
    // the right one.
    alignas(64) R along_[kCellEdges][Batch<R>::kSize], zeros_[Batch<R>::kSize], ones_[Batch<R>::kSize];
    const R* at_[kCellEdges][3];
};

// The four rows of samples around a row of cells, at (y, z), (y + 1, z), (y, z + 1) and (y + 1, z + 1). Index
// i of the levels belongs to sample i - 1.
template <class T>
class LevelRows {
  public:
    using R = Real<T>;

    LevelRows(const VolumeView& volume, const Levels& levels, const std::uint8_t* outside, std::int64_t y,
              std::int64_t z)
        : nx_(volume.geometry.dims[0]) {
        const std::int64_t ny = volume.geometry.dims[1], nz = volume.geometry.dims[2];
        for (std::int64_t r = 0; r < 4; ++r) {
            const std::int64_t sy = y + (r & 1), sz = z + (r >> 1);
            const bool within = sy >= 0 && sy < ny && sz >= 0 && sz < nz;
            levels_[r] = within ? levels.bytes.data() + (sz * ny + sy) * levels.stride : outside;
            samples_[r] = within ? row_of<T>(volume, sy, sz) : nullptr;
            all_within_ &= within;
        }
    }

    // Finds the lowest and highest level at each x, and the cells whose corners differ in level.
    HWY_INLINE void find_active(std::size_t width, std::uint8_t* HWY_RESTRICT low,
                                std::uint8_t* HWY_RESTRICT high, std::uint8_t* HWY_RESTRICT active) const {
        const auto& l = levels_;
        for (std::size_t i = 0; i < width; ++i) {
            low[i] = std::min(std::min(l[0][i], l[1][i]), std::min(l[2][i], l[3][i]));
            high[i] = std::max(std::max(l[0][i], l[1][i]), std::max(l[2][i], l[3][i]));
        }
        for (std::size_t i = 0; i + 1 < width; ++i)
            active[i] = std::max(high[i], high[i + 1]) != std::min(low[i], low[i + 1]);
    }

    // The levels of the cell's corners; corner v is byte v.
    HWY_INLINE std::uint64_t corner_levels(std::size_t i) const {
        std::uint64_t corners = 0;
        for (unsigned r = 0; r < 4; ++r) {
            const unsigned two = levels_[r][i] | unsigned{levels_[r][i + 1]} << 8;
            corners |= std::uint64_t{two} << (16 * r);
        }
        return corners;
    }

    // The samples at the cell's corners, multiplied by kSampleScale; -infinity outside the volume.
    HWY_INLINE void corner_values(std::size_t i, R (&value)[8]) const {
        const std::int64_t x = static_cast<std::int64_t>(i) - 1;
        const bool within = all_within_ && x >= 0 && x + 1 < nx_;
        for (unsigned r = 0; r < 4; ++r) {
            for (std::int64_t s = 0; s < 2; ++s) {
                const bool has_value = within || (samples_[r] != nullptr && x + s >= 0 && x + s < nx_);
                value[2 * r + static_cast<unsigned>(s)] =
                    has_value ? static_cast<R>(samples_[r][x + s]) * kSampleScale<T>
                              : -std::numeric_limits<R>::infinity();
            }
        }
    }

  private:
    const std::int64_t nx_;
    const std::uint8_t* levels_[4];
    const T* samples_[4];
    bool all_within_ = true;
};

// The case of a cell for isovalue k. A corner is inside if its level is above k. Levels have seven bits. So
// the eighth bit of each byte is free: it stays set in the difference if the level is at least k + 1. A
// product then gathers these bits.
HWY_INLINE std::uint8_t cell_case_at(std::uint64_t corner_levels, std::size_t k) {
    constexpr std::uint64_t kOnes = 0x0101010101010101u, kTops = 0x8080808080808080u;
    const std::uint64_t inside = ((corner_levels | kTops) - (k + 1) * kOnes) & kTops;
    return static_cast<std::uint8_t>(((inside >> 7) * 0x0102040810204080u) >> 56);
}

template <class T>
void add_cells_of(const VolumeView& volume, const IndexToPhysical& to_physical, const Levels& levels,
                  std::span<const double> isovalues, std::int64_t z, CellMeasures& sums) {
    using R = Real<T>;
    const std::int64_t ny = volume.geometry.dims[1];
    const auto slice = std::make_unique<SliceSums<R>>(to_physical.exact, sums);

    R isovalue[Levels::kMost];
    for (std::size_t k = 0; k < isovalues.size(); ++k)
        isovalue[k] = static_cast<R>(isovalues[k]) * kSampleScale<T>;
    const auto width = static_cast<std::size_t>(levels.stride);
    const std::vector<std::uint8_t> outside(width, 0);
    std::vector<std::uint8_t> low(width), high(width), active(width);

    for (std::int64_t y = -1; y < ny; ++y) {
        const LevelRows<T> rows(volume, levels, outside.data(), y, z);
        rows.find_active(width, low.data(), high.data(), active.data());
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
            const std::uint64_t corner_levels = rows.corner_levels(i);
            R value[8];
            rows.corner_values(i, value);
            const std::size_t last = std::max(high[i], high[i + 1]);
            for (std::size_t k = std::min(low[i], low[i + 1]); k < last; ++k)
                slice->add(cell_case_at(corner_levels, k), value, isovalue[k], k);
        }
    }
    slice->flush();
}

void add_cells_any(const VolumeView& volume, const IndexToPhysical& to_physical, const Levels& levels,
                   std::span<const double> isovalues, std::int64_t z, CellMeasures& sums) {
    visit_sample_type(volume.type, [&](auto sample) {
        add_cells_of<decltype(sample)>(volume, to_physical, levels, isovalues, z, sums);
    });
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(add_cells_any);

void add_cells(const VolumeView& volume, const IndexToPhysical& to_physical, const Levels& levels,
               std::span<const double> isovalues, std::int64_t z, CellMeasures& sums) {
    HWY_DYNAMIC_DISPATCH(add_cells_any)(volume, to_physical, levels, isovalues, z, sums);
}

}  // namespace marrow::internal
#endif
