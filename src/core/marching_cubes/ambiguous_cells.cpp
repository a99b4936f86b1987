// Finds ambiguous cells from the inside bits, and asks their samples.
#include "ambiguous_cells.h"

#include <hwy/base.h>
#include <hwy/cache_control.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "candidate_cells.h"
#include "core/volume/rows.h"
#include "inner_points.h"

namespace marrow::internal {

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// The samples of the cells of a row.
template <class T>
class CornerSamples {
  public:
    CornerSamples() = default;
    CornerSamples(const VolumeView& volume, std::int64_t y, std::int64_t z) : nx_(volume.geometry.dims[0]) {
        const auto [nx, ny, nz] = volume.geometry.dims;
        for (std::size_t r = 0; r < 4; ++r) {
            const std::int64_t row_y = y + static_cast<std::int64_t>(r & 1),
                               row_z = z + static_cast<std::int64_t>(r >> 1);
            const bool within = row_y >= 0 && row_y < ny && row_z >= 0 && row_z < nz;
            rows_[r] = within ? row_of<T>(volume, row_y, row_z) : nullptr;
            all_rows_ &= within;
        }
    }

    CellValues minus(double isovalue, std::int64_t x) const {
        CellValues values;
        if (HWY_LIKELY(all_rows_ && x >= 0 && x + 1 < nx_)) {
            for (std::size_t v = 0; v < 8; ++v)
                values[v] = difference(rows_[v >> 1][x + static_cast<std::int64_t>(v & 1)], isovalue);
            return values;
        }
        for (std::size_t v = 0; v < 8; ++v) {
            const std::int64_t at = x + static_cast<std::int64_t>(v & 1);
            const T* const row = rows_[v >> 1];
            values[v] = row != nullptr && at >= 0 && at < nx_ ? difference(row[at], isovalue) : kNan;
        }
        return values;
    }

    void prefetch(std::int64_t x) const {
        for (const T* row : rows_) {
            if (row != nullptr) hwy::Prefetch(row + x);
        }
    }

  private:
    // It has the right sign: a rounded difference is 0 only if the exact one is.
    static double difference(T sample, double isovalue) {
        const double result = static_cast<double>(sample) - isovalue;
        if constexpr (std::is_floating_point_v<T>) {
            if (HWY_UNLIKELY(!std::isfinite(result))) {
                constexpr double kMost = std::numeric_limits<double>::max();
                return std::isfinite(sample) ? std::clamp(result, -kMost, kMost) : kNan;
            }
        }
        return result;
    }

    std::int64_t nx_ = 0;
    const T* rows_[4] = {};
    bool all_rows_ = true;
};

// The candidates of consecutive rows.
struct Candidates {
    const InsideBits& bits;
    std::size_t row_begin;
    CandidateCells cells;
    std::vector<std::size_t> row_ends;  // in `cells`

    Candidates(const InsideBits& inside_bits, std::size_t first_row)
        : bits(inside_bits), row_begin(first_row) {}

    void add_row(const std::uint64_t* masks, std::size_t mask_count) {
        cells.add_row(bits, row_begin + row_ends.size(), masks, mask_count);
        row_ends.push_back(cells.size());
    }
    void add_empty_row() { row_ends.push_back(cells.size()); }
};

// The samples of candidates, in the order of these.
template <class T>
class CandidateSamples {
  public:
    CandidateSamples(const VolumeView& volume, const Candidates& candidates)
        : volume_(volume),
          candidates_(candidates),
          row_(candidates.row_begin - 1) {}  // the row before the first, which may wrap

    // The row of a candidate. \pre not before that of the last call
    std::size_t row_of(std::size_t cell) {
        const auto& ends = candidates_.row_ends;
        if (cell < end_) return row_;
        do {
            end_ = ends[++row_ - candidates_.row_begin];
        } while (cell >= end_);
        const InsideBits& bits = candidates_.bits;
        const GridRow at(bits, row_);
        samples_ = {volume_, at.y - bits.first_y, at.z - bits.first_z};
        return row_;
    }
    void prefetch(std::size_t cell) {
        row_of(cell);
        samples_.prefetch(x_of(cell));
    }
    CellValues minus(double isovalue, std::size_t cell) const { return samples_.minus(isovalue, x_of(cell)); }

  private:
    std::int64_t x_of(std::size_t cell) const { return candidates_.cells.x(cell) - candidates_.bits.first_x; }

    const VolumeView& volume_;
    const Candidates& candidates_;
    std::size_t row_, end_ = 0;
    CornerSamples<T> samples_;
};

// Calls found(row, cell, topology) for each ambiguous cell. Each candidate asks for its samples a while before it is
// decided: those of a large volume are not in the cache, and a miss takes longer than a decision.
template <class T, class Found>
void decide(const VolumeView& volume, double isovalue, const Candidates& candidates, const Found& found) {
    constexpr std::size_t kAtOnce = CellBatch::kCells, kAhead = 2 * kAtOnce;
    const CandidateCells& cells = candidates.cells;
    CandidateSamples<T> ahead(volume, candidates), samples(volume, candidates);
    CellBatch batch;
    std::size_t asked = 0;
    for (std::size_t begin = 0; begin < cells.size(); begin += kAtOnce) {
        for (const std::size_t end = std::min(begin + kAtOnce + kAhead, cells.size()); asked < end; ++asked)
            ahead.prefetch(asked);
        const std::size_t count = std::min(kAtOnce, cells.size() - begin);
        std::size_t rows[kAtOnce];
        std::uint8_t cases[kAtOnce] = {};
        for (std::size_t i = 0; i < count; ++i) {
            rows[i] = samples.row_of(begin + i);
            cases[i] = cells.cell_case(begin + i);
            batch.set(i, samples.minus(isovalue, begin + i));
        }
        CellTopology topologies[kAtOnce];
        decide_topologies(batch, cases, count, topologies);
        for (std::size_t i = 0; i < count; ++i) {
            const CellTopology& topology = topologies[i];
            if (topology.is_default(cases[i])) continue;
            const AmbiguousCell cell{cells.x(begin + i),
                                     static_cast<std::uint16_t>(topology.shape - kShapes.data()), cases[i],
                                     static_cast<std::uint8_t>(topology.inner_points())};
            found(rows[i], cell, topology);
        }
    }
}

// The derivative of the samples at *p along an axis: central differences where the samples allow, else one-sided ones,
// as for the normals of points on edges. `before` and `after` are the steps to the samples beside it, or 0.
template <class T>
double slope(const T* p, std::int64_t before, std::int64_t after) {
    // Halved before the difference, so that it does not overflow.
    const double rise = static_cast<double>(p[after]) / 2 - static_cast<double>(p[-before]) / 2;
    return before != 0 && after != 0 ? rise : 2 * rise;
}

// The gradient at a point of a cell, interpolated between those of its corners.
template <class T>
Vec3d smooth_gradient(const VolumeView& volume, const std::array<std::int64_t, 3>& cell, const Vec3d& at) {
    const std::array<std::int64_t, 3> stride{1, volume.row_pitch(), volume.slice_pitch()};
    std::array<std::array<std::int64_t, 2>, 3> before, after;  // by axis and side of the cell
    for (std::size_t a = 0; a < 3; ++a) {
        for (std::size_t side = 0; side < 2; ++side) {
            const std::int64_t i = cell[a] + static_cast<std::int64_t>(side);
            before[a][side] = i > -volume.below[a] ? stride[a] : 0;
            after[a][side] = i + 1 < volume.geometry.dims[a] + volume.above[a] ? stride[a] : 0;
        }
    }
    const T* const first = row_of<T>(volume, cell[1], cell[2]) + cell[0];
    Vec3d gradient{};
    for (std::size_t v = 0; v < 8; ++v) {
        const T* p = first;
        double weight = 1;
        Vec3d slopes;
        for (std::size_t a = 0; a < 3; ++a) {
            const bool far = (v >> a & 1) != 0;
            p += far ? stride[a] : 0;
            weight *= far ? at[a] : 1 - at[a];
        }
        for (std::size_t a = 0; a < 3; ++a) slopes[a] = slope(p, before[a][v >> a & 1], after[a][v >> a & 1]);
        gradient = gradient + weight * slopes;
    }
    return gradient;
}

// The gradient at a point of a cell: that of the samples around it, which is smooth across cells. Where it would
// turn the surface over, or a sample is not finite, it is that of the interpolant or of the inside bits.
Vec3d gradient_in_cell(const VolumeView& volume, const std::array<std::int64_t, 3>& cell,
                       const CellValues& values, const Vec3d& at) {
    if (std::any_of(values.begin(), values.end(), [](double v) { return std::isnan(v); })) {
        CellValues sides;
        for (std::size_t v = 0; v < 8; ++v) sides[v] = values[v] >= 0 ? 1 : -1;
        return Interpolant(sides, at).gradient;
    }
    const Vec3d smooth = visit_sample_type(
        volume.type, [&](auto sample) { return smooth_gradient<decltype(sample)>(volume, cell, at); });
    const Vec3d own = Interpolant(well_scaled(values), at).gradient;
    return dot(smooth, own) > 0 ? smooth : own;
}

Vec3f normal_of(const IndexToPhysical& to_physical, const Vec3d& gradient) {
    double steepest = 0;
    for (const double g : gradient) steepest = std::max(steepest, std::abs(g));
    Vec3d normal;
    for (std::size_t r = 0; r < 3; ++r)
        normal[r] = dot(to_double(to_physical.normal_matrix[r]), (1 / steepest) * gradient);
    const double per_length = 1 / length(normal);
    if (!std::isfinite(per_length)) return to_physical.axis[0];  // where there is no gradient
    return to_float(per_length * normal);
}

}  // namespace

std::size_t KeptCells::bytes() const {
    std::size_t bytes = row_begin.size() * sizeof(std::uint32_t);
    for (const auto& cells : of_slice) bytes += cells.capacity() * sizeof(AmbiguousCell);
    return bytes;
}

void AmbiguousCells::count(std::int64_t slice, RowCounts& counts) const {
    const std::size_t row_begin = bits_.row_index(0, slice), row_end = bits_.row_index(0, slice + 1);
    std::vector<AmbiguousCell>* const kept =
        kept_ ? &kept_->of_slice[static_cast<std::size_t>(slice)] : nullptr;
    if (kept != nullptr) kept->clear();
    Candidates candidates(bits_, row_begin);
    for (std::size_t row = row_begin; row < row_end; ++row) {
        counts.inner[row] = counts.more_triangles[row] = 0;
        if (!has_any(row)) {
            candidates.add_empty_row();
            continue;
        }
        candidates.add_row(words_.row(row), words_.masks_per_row);
        std::fill_n(words_.row(row), words_.masks_per_row, std::uint64_t{0});
    }
    std::size_t next_row = row_begin;  // the first whose cells were not kept yet
    const auto keep_until = [&](std::size_t row) {
        for (; next_row < row; ++next_row)
            kept_->row_begin[next_row] = static_cast<std::uint32_t>(kept->size());
    };
    const auto found = [&](std::size_t row, const AmbiguousCell& cell, const CellTopology& topology) {
        const std::size_t w = cell.x / 64;
        words_.row(row)[w / 64] |= std::uint64_t{1} << w % 64;
        counts.inner[row] += cell.inner_points;
        const int more = topology.has_tunnel ? topology.triangles() - kCases[cell.cell_case].triangles
                                             : kMoreTriangles[cell.shape];
        counts.more_triangles[row] += static_cast<std::uint32_t>(more);
        if (kept == nullptr) return;
        keep_until(row + 1);
        kept->push_back(cell);
    };
    visit_sample_type(volume_.type,
                      [&](auto sample) { decide<decltype(sample)>(volume_, isovalue_, candidates, found); });
    if (kept != nullptr) keep_until(row_end);
}

std::span<const AmbiguousCell> AmbiguousCells::of_row(std::size_t row,
                                                      std::vector<AmbiguousCell>& memory) const {
    const GridRow at(bits_, row);
    if (kept_ != nullptr) {
        const auto& cells = kept_->of_slice[static_cast<std::size_t>(at.z)];
        const std::size_t begin = kept_->row_begin[row];
        const std::size_t end = at.y + 1 < bits_.ny ? kept_->row_begin[row + 1] : cells.size();
        return {cells.data() + begin, end - begin};
    }
    memory.clear();
    Candidates candidates(bits_, row);
    candidates.add_row(words_.row(row), words_.masks_per_row);
    const auto found = [&](std::size_t, const AmbiguousCell& cell, const CellTopology&) {
        memory.push_back(cell);
    };
    visit_sample_type(volume_.type,
                      [&](auto sample) { decide<decltype(sample)>(volume_, isovalue_, candidates, found); });
    return memory;
}

AmbiguousCells::InnerCell AmbiguousCells::inner_cell(std::size_t row, const AmbiguousCell& cell) const {
    const GridRow at(bits_, row);
    InnerCell result;
    result.index = {cell.x - bits_.first_x, at.y - bits_.first_y, at.z - bits_.first_z};
    visit_sample_type(volume_.type, [&](auto sample) {
        const CornerSamples<decltype(sample)> samples(volume_, result.index[1], result.index[2]);
        result.values = samples.minus(isovalue_, result.index[0]);
    });
    result.topology = {&kShapes[cell.shape]};
    if (cell.inner_points == CellTopology::kTunnelPoints)
        result.topology = decide_topology(cell.cell_case, result.values);
    return result;
}

void AmbiguousCells::emit_points(std::size_t row, std::vector<AmbiguousCell>& memory, Vec3f* points,
                                 Vec3f* normals) const {
    for (const AmbiguousCell& ambiguous : of_row(row, memory)) {
        if (ambiguous.inner_points == 0) continue;
        const InnerCell cell = inner_cell(row, ambiguous);
        const auto& first = to_physical_.first;
        std::array<Vec3d, CellTopology::kTunnelPoints> inner;
        const int count = place_inner_points(cell.topology, cell.values, inner);
        for (int k = 0; k < count; ++k) {
            const Vec3d& in_cell = inner[static_cast<std::size_t>(k)];
            Vec3d in_whole;
            for (std::size_t a = 0; a < 3; ++a)
                in_whole[a] = static_cast<double>(first[a] + cell.index[a]) + in_cell[a];
            *points++ = to_float(to_physical_.origin + to_physical_.exact * in_whole);
            if (normals != nullptr)
                *normals++ =
                    normal_of(to_physical_, gradient_in_cell(volume_, cell.index, cell.values, in_cell));
        }
    }
}

std::uint32_t* AmbiguousCells::emit_triangles(std::size_t row, const AmbiguousCell& cell,
                                              const std::uint32_t* edge_ids, std::uint32_t first_inner,
                                              std::uint32_t* out) const {
    const std::size_t second = to_physical_.mirrored ? 2 : 1, third = 3 - second;
    const auto id = [&](std::uint8_t corner) {
        return corner < kCellEdges ? edge_ids[corner] : first_inner + (corner - kCellEdges);
    };
    const auto emit = [&](const std::uint8_t* corners, int triangles) {
        for (const std::uint8_t* const end = corners + 3 * triangles; corners != end; corners += 3) {
            *out++ = id(corners[0]);
            *out++ = id(corners[second]);
            *out++ = id(corners[third]);
        }
    };
    if (cell.inner_points == CellTopology::kTunnelPoints) {
        const InnerCell inner = inner_cell(row, cell);
        const TunnelTriangles triangles = triangulate_tunnel(inner.topology, inner.values);
        emit(triangles.corners.data(), triangles.count);
    } else {
        emit(kShapes[cell.shape].corners.data(), kShapes[cell.shape].triangles);
    }
    return out;
}

}  // namespace marrow::internal
