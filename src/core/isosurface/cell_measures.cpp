#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/isosurface/cell_measures.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>

#include "core/grid/case_table.h"
#include "cell_measures.h"
#include "core/volume/visit_samples.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Cells of one case, eight at a time, each with one isovalue.
template <class R>
struct Batch {
    static constexpr std::size_t kSize = 8;

    alignas(64) R corner[8][kSize];  // samples' differences from the isovalue; infinite: no value
    std::uint8_t isovalue[kSize];
    std::size_t size = 0;
};

// What the cells of a slice add. In index space, where every crossed edge lies along an axis, normals are simple; what maps them
// to space is the same for all.
template <class R>
class SliceSums {
  public:
    SliceSums(const Mat3d& matrix, double z, CellSums& sums) : sums_(sums), three_z_(static_cast<R>(3 * z)) {
        Mat3d cofactor;
        for (std::size_t r = 0; r < 3; ++r) {
            const std::size_t r1 = (r + 1) % 3, r2 = (r + 2) % 3;
            for (std::size_t c = 0; c < 3; ++c) {
                const std::size_t c1 = (c + 1) % 3, c2 = (c + 2) % 3;
                cofactor[r][c] = matrix[r1][c1] * matrix[r2][c2] - matrix[r1][c2] * matrix[r2][c1];
            }
        }
        for (std::size_t e = 0; e < kCellEdges; ++e) {
            const int first = kEdgeCorners[e][0], axis = kEdgeCorners[e][1] - first;
            for (int r = 0; r < 3; ++r)
                at_[e][r] = axis == 1 << r ? along_[e] : (first >> r & 1) != 0 ? ones_ : zeros_;
        }
        std::fill(zeros_, std::end(zeros_), R(0));
        std::fill(ones_, std::end(ones_), R(1));
        double determinant = 0;
        for (std::size_t c = 0; c < 3; ++c) determinant += matrix[0][c] * cofactor[0][c];
        to_volume_ = std::abs(determinant);
        for (std::size_t a = 0; a < 3; ++a) {
            for (std::size_t b = 0; b < 3; ++b) {
                double dot = 0;
                for (std::size_t r = 0; r < 3; ++r) dot += cofactor[r][a] * cofactor[r][b];
                square_[a][b] = static_cast<R>(a == b ? dot : 2 * dot);
            }
        }
    }

    // Adds a cell; `value` on the samples' scale.
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
        const auto half = hn::Set(d, R(0.5)), most = hn::Set(d, std::numeric_limits<R>::max());
        alignas(64) R twice_area[kSize], six_volumes[kSize];
        for (std::size_t i = 0; i < kSize; i += hn::Lanes(d)) {
            for (std::size_t e = 0; e < kCellEdges; ++e) {
                if ((c.crossed >> e & 1) == 0) continue;
                const auto from = hn::Load(d, batch.corner[kEdgeCorners[e][0]] + i);
                const auto difference = hn::Sub(from, hn::Load(d, batch.corner[kEdgeCorners[e][1]] + i));
                // Where one end has no value, the point is in the middle.
                const auto t =
                    hn::IfThenElse(hn::Le(hn::Abs(difference), most), hn::Div(from, difference), half);
                hn::Store(t, d, along_[e] + i);
            }
            auto area = hn::Zero(d), volume = hn::Zero(d);
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
                // No fused operations, so that the numbers are the same on every processor.
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
                // The flux of (0, 0, z).
                const auto z = hn::Add(hn::Add(hn::Add(az, bz), cz), hn::Set(d, three_z_));
                volume = hn::Add(volume, hn::Mul(nz, z));
            }
            hn::Store(area, d, twice_area + i);
            hn::Store(volume, d, six_volumes + i);
        }
        for (std::size_t n = 0; n < batch.size; ++n) {
            const std::size_t k = batch.isovalue[n];
            sums_.area[k] += static_cast<double>(twice_area[n]);
            sums_.volume[k] += static_cast<double>(six_volumes[n]) * to_volume_;
            sums_.triangles[k] += c.triangles;
        }
        batch.size = 0;
    }

    CellSums& sums_;
    const R three_z_;
    double to_volume_;
    R square_[3][3];  // of a normal, taken to space: the sum over a <= b of square_[a][b] n[a] n[b]
    std::array<Batch<R>, 256> batches_;
    // Where points are on their edges; and each coordinate of them, which is that or one of the edge's ends.
    alignas(64) R along_[kCellEdges][Batch<R>::kSize], zeros_[Batch<R>::kSize], ones_[Batch<R>::kSize];
    const R* at_[kCellEdges][3];
};

template <class T>
void add_cells_of(const VolumeView& volume, const Frame& frame, const Levels& levels,
                  std::span<const double> isovalues, std::int64_t z, CellSums& sums) {
    using R = Real<T>;
    const auto [nx, ny, nz] = volume.geometry.dims;
    const auto slice = std::make_unique<SliceSums<R>>(
        frame.exact, static_cast<double>(z) - 0.5 * static_cast<double>(nz - 1), sums);

    R isovalue[Levels::kMost];  // on the samples' scale
    for (std::size_t k = 0; k < isovalues.size(); ++k)
        isovalue[k] = static_cast<R>(isovalues[k]) * kSampleScale<T>;
    const std::vector<std::uint8_t> outside(static_cast<std::size_t>(levels.stride), 0);
    const auto width = static_cast<std::size_t>(levels.stride);
    std::vector<std::uint8_t> low(width), high(width), active(width);

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
        const bool inside_rows = row >= 0 && row + 1 < ny && z >= 0 && z + 1 < nz;
        for (std::size_t i = 0; i < width; ++i) {
            low[i] = std::min(std::min(level[0][i], level[1][i]), std::min(level[2][i], level[3][i]));
            high[i] = std::max(std::max(level[0][i], level[1][i]), std::max(level[2][i], level[3][i]));
        }
        for (std::size_t i = 0; i + 1 < width; ++i)
            active[i] = std::max(high[i], high[i + 1]) != std::min(low[i], low[i + 1]);

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
            const bool within = inside_rows && cell_x >= 0 && cell_x + 1 < nx;
            for (unsigned r = 0; r < 4; ++r) {
                const unsigned two = level[r][i] | unsigned{level[r][i + 1]} << 8;
                corner_levels |= std::uint64_t{two} << (16 * r);
                for (std::int64_t s = 0; s < 2; ++s) {
                    const bool has_value =
                        within || (sample[r] != nullptr && cell_x + s >= 0 && cell_x + s < nx);
                    value[2 * r + static_cast<unsigned>(s)] =
                        has_value ? static_cast<R>(sample[r][cell_x + s]) * kSampleScale<T>
                                  : -std::numeric_limits<R>::infinity();
                }
            }
            const std::size_t last = std::max(high[i], high[i + 1]);
            for (std::size_t k = std::min(low[i], low[i + 1]); k < last; ++k) {
                // A corner is inside surface k where its level is above k. Levels have seven bits, so the eighth of each
                // byte of a difference tells; a product gathers them.
                constexpr std::uint64_t kOnes = 0x0101010101010101u, kTops = 0x8080808080808080u;
                const std::uint64_t inside = ((corner_levels | kTops) - (k + 1) * kOnes) & kTops;
                const auto cell_case = static_cast<std::uint8_t>(((inside >> 7) * 0x0102040810204080u) >> 56);
                slice->add(cell_case, value, isovalue[k], k);
            }
        }
    }
    slice->flush();
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
