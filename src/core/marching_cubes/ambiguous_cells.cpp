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
#include "inner_normals.h"
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
            double check = 0;  // becomes NaN if a value is not finite
            for (std::size_t v = 0; v < 8; ++v) {
                values[v] =
                    static_cast<double>(rows_[v >> 1][x + static_cast<std::int64_t>(v & 1)]) - isovalue;
                if constexpr (std::is_floating_point_v<T>) check += 0 * values[v];
            }
            if (HWY_LIKELY(check == 0)) return values;
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

// A row with candidates, and where these end.
struct CandidateRow {
    std::int64_t y;
    std::size_t end;
};

// The candidates of a slice.
struct Candidates {
    const InsideBits& bits;
    std::int64_t slice;
    CandidateCells cells;
    std::vector<CandidateRow> rows;

    // Those in the words that are marked in the masks of the slice's rows.
    Candidates(const InsideBits& inside_bits, std::int64_t z, const std::uint64_t* masks)
        : bits(inside_bits), slice(z) {
        const std::size_t per_row = ActiveWords::masks_per_row_of(bits);
        const std::size_t first = bits.row_index(0, z);
        if (z + 1 == bits.nz) return;  // no cells begin there
        for (std::int64_t y = 0; y + 1 < bits.ny; ++y, masks += per_row) {
            if (std::all_of(masks, masks + per_row, [](std::uint64_t m) { return m == 0; })) continue;
            const std::size_t before = cells.size();
            cells.add_row(bits, first + static_cast<std::size_t>(y), masks, per_row);
            if (cells.size() > before) rows.push_back({y, cells.size()});
        }
    }
};

// The samples of the candidates of a slice, which are asked for in their order.
template <class T>
class CandidateSamples {
  public:
    CandidateSamples(const VolumeView& volume, const Candidates& candidates)
        : volume_(volume), candidates_(candidates), next_row_(candidates.rows.begin()) {}

    void prefetch(std::size_t cell) {
        reach(cell);
        samples_.prefetch(x_of(cell));
    }
    CellValues minus(double isovalue, std::size_t cell) {
        reach(cell);
        return samples_.minus(isovalue, x_of(cell));
    }

  private:
    void reach(std::size_t cell) {
        if (HWY_LIKELY(cell < end_)) return;
        const InsideBits& bits = candidates_.bits;
        samples_ = {volume_, next_row_->y - bits.first_y, candidates_.slice - bits.first_z};
        end_ = next_row_++->end;
    }
    std::int64_t x_of(std::size_t cell) const { return candidates_.cells.x(cell) - candidates_.bits.first_x; }

    const VolumeView& volume_;
    const Candidates& candidates_;
    std::vector<CandidateRow>::const_iterator next_row_;
    std::size_t end_ = 0;  // of the row's candidates
    CornerSamples<T> samples_;
};

// Calls found(cell, topology) for each candidate, in their order. Each asks for its samples a while before it
// is decided: those of a large volume are not in the cache, and a miss takes longer than a decision.
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
        std::uint8_t cases[kAtOnce] = {};
        for (std::size_t i = 0; i < count; ++i) {
            cases[i] = cells.cell_case(begin + i);
            batch.set(i, samples.minus(isovalue, begin + i));
        }
        CellTopology topologies[kAtOnce];
        decide_topologies(batch, cases, count, topologies);
        for (std::size_t i = 0; i < count; ++i) found(begin + i, cases[i], topologies[i]);
    }
}

// The derivative of the samples at *p along an axis: central differences where the samples allow,
// else one-sided ones, as for the normals of points on edges. `before` and `after` are the steps
// to the samples beside it, or 0.
template <class T>
double slope(const T* p, std::int64_t before, std::int64_t after) {
    // Halved before the difference, so that it does not overflow.
    const double rise = static_cast<double>(p[after]) / 2 - static_cast<double>(p[-before]) / 2;
    return before != 0 && after != 0 ? rise : 2 * rise;
}

// The slopes of the cells of a row.
template <class T>
class RowSlopes {
  public:
    RowSlopes(const VolumeView& volume, std::int64_t y, std::int64_t z)
        : volume_(volume), y_(y), z_(z), stride_{1, volume.row_pitch(), volume.slice_pitch()} {
        find_neighbours(1, y);
        find_neighbours(2, z);
    }

    // Where a sample is not finite, those of the inside bits.
    CellSlopes of_cell(std::int64_t x, const CellValues& values) {
        CellSlopes cell;
        if (std::any_of(values.begin(), values.end(), [](double v) { return std::isnan(v); })) {
            for (std::size_t v = 0; v < 8; ++v) cell.values[v] = values[v] >= 0 ? 1 : -1;
            return cell;
        }
        cell.values = well_scaled(values);
        cell.has_corners = true;
        find_neighbours(0, x);
        const T* const first = row_of<T>(volume_, y_, z_) + x;
        for (std::size_t v = 0; v < 8; ++v) {
            const T* p = first;
            for (std::size_t a = 0; a < 3; ++a) p += (v >> a & 1) != 0 ? stride_[a] : 0;
            for (std::size_t a = 0; a < 3; ++a)
                cell.corners[v][a] = slope(p, before_[a][v >> a & 1], after_[a][v >> a & 1]);
        }
        return cell;
    }

  private:
    void find_neighbours(std::size_t axis, std::int64_t place) {
        for (std::size_t side = 0; side < 2; ++side) {
            const std::int64_t i = place + static_cast<std::int64_t>(side);
            before_[axis][side] = i > -volume_.below[axis] ? stride_[axis] : 0;
            after_[axis][side] =
                i + 1 < volume_.geometry.dims[axis] + volume_.above[axis] ? stride_[axis] : 0;
        }
    }

    const VolumeView& volume_;
    const std::int64_t y_, z_;
    const std::array<std::int64_t, 3> stride_;
    // The steps from the samples at the two sides of the cell, by axis, or 0.
    std::array<std::array<std::int64_t, 2>, 3> before_, after_;
};

}  // namespace

void AmbiguousCells::count(std::int64_t slice, RowCounts& counts, ActiveWords& active) {
    std::vector<std::uint64_t> masks(active.masks_per_row * static_cast<std::size_t>(bits_.ny));
    count_rows(bits_, bits_.row_index(0, slice), bits_.row_index(0, slice + 1), counts, active, masks.data());
    find(slice, masks.data());
}

void AmbiguousCells::find_again(std::int64_t slice, const ActiveWords& active) {
    find(slice, active.row(bits_.row_index(0, slice)));
}

void AmbiguousCells::forget(std::int64_t slice) {
    Slice& kept = slices_[static_cast<std::size_t>(slice)];
    kept.cells = {};
    kept.rows.shrink_to_fit();
}

void AmbiguousCells::find(std::int64_t slice, const std::uint64_t* masks) {
    std::vector<AmbiguousRow>& rows = slices_[static_cast<std::size_t>(slice)].rows;
    Buffer<AmbiguousCell>& cells = slices_[static_cast<std::size_t>(slice)].cells;
    rows.clear();
    const Candidates candidates(bits_, slice, masks);
    // Branches on what the samples decide would often be mispredicted. So each cell is written, and the next
    // one overwrites it if it is not ambiguous.
    cells.resize(candidates.cells.size() + 1);
    std::size_t found = 0;
    auto candidate_row = candidates.rows.begin();
    AmbiguousRow row{};
    visit_sample_type(volume_.type, [&](auto sample) {
        decide<decltype(sample)>(
            volume_, isovalue_, candidates,
            [&](std::size_t candidate, std::uint8_t cell_case, const CellTopology& topology) {
                const std::size_t shape = static_cast<std::size_t>(topology.shape - kShapes.data());
                AmbiguousCell& cell = cells[found];
                ShapeChange change = kShapeChanges[shape];
                if (HWY_UNLIKELY(topology.has_tunnel)) change = topology.change(cell_case);
                cell = {candidates.cells.x(candidate), static_cast<std::uint16_t>(shape), topology.tunnel,
                        change.inner_points};
                row.inner_points += change.inner_points;
                row.more_triangles += static_cast<std::uint32_t>(change.more_triangles);
                found += topology.is_default(cell_case) ? 0 : 1;
                if (HWY_LIKELY(candidate + 1 < candidate_row->end)) return;
                row.y = static_cast<std::uint32_t>(candidate_row++->y);
                row.cells_end = static_cast<std::uint32_t>(found);
                if (found > (rows.empty() ? 0 : rows.back().cells_end)) rows.push_back(row);
                row = {};
            });
    });
    cells.resize(found);
}

void AmbiguousCells::add_to(RowCounts& counts, std::int64_t slice) const {
    const std::size_t first = bits_.row_index(0, slice);
    for (const AmbiguousRow& row : slices_[static_cast<std::size_t>(slice)].rows) {
        counts.points[first + row.y] += row.inner_points;
        counts.triangles[first + row.y] += row.more_triangles;
    }
}

std::size_t AmbiguousCells::bytes() const {
    std::size_t bytes = slices_.size() * sizeof(Slice);
    for (const Slice& slice : slices_) {
        bytes +=
            slice.rows.capacity() * sizeof(AmbiguousRow) + slice.cells.capacity() * sizeof(AmbiguousCell);
    }
    return bytes;
}

void AmbiguousCells::emit_points(std::size_t row, std::span<const AmbiguousCell> cells, Vec3f* points,
                                 Vec3f* normals) const {
    visit_sample_type(volume_.type,
                      [&](auto sample) { emit_points_of<decltype(sample)>(row, cells, points, normals); });
}

template <class T>
void AmbiguousCells::emit_points_of(std::size_t row, std::span<const AmbiguousCell> cells, Vec3f* points,
                                    Vec3f* normals) const {
    const GridRow at(bits_, row);
    const std::int64_t y = at.y - bits_.first_y, z = at.z - bits_.first_z;
    const auto& first = to_physical_.first;
    const CornerSamples<T> samples(volume_, y, z);
    RowSlopes<T> slopes(volume_, y, z);
    for (const AmbiguousCell& cell : cells) {
        if (cell.inner_points == 0) continue;
        const std::int64_t x = cell.x - bits_.first_x;
        const CellValues values = samples.minus(isovalue_, x);
        const Vec3d corner{static_cast<double>(first[0] + x), static_cast<double>(first[1] + y),
                           static_cast<double>(first[2] + z)};
        std::array<Vec3d, CellTopology::kTunnelPoints> inner;
        const int count = place_inner_points(cell.topology(), values, inner);
        for (int k = 0; k < count; ++k) {
            points[k] = to_float(to_physical_.origin +
                                 to_physical_.exact * (corner + inner[static_cast<std::size_t>(k)]));
        }
        points += count;
        if (normals == nullptr) continue;
        inner_normals(slopes.of_cell(x, values), inner.data(), static_cast<std::size_t>(count), to_physical_,
                      normals);
        normals += count;
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
    const CellTopology topology = cell.topology();
    if (topology.has_tunnel) {
        const GridRow at(bits_, row);
        CellValues values;
        visit_sample_type(volume_.type, [&](auto sample) {
            const CornerSamples<decltype(sample)> samples(volume_, at.y - bits_.first_y,
                                                          at.z - bits_.first_z);
            values = samples.minus(isovalue_, cell.x - bits_.first_x);
        });
        const TunnelTriangles triangles = triangulate_tunnel(topology, values);
        emit(triangles.corners.data(), triangles.count);
    } else {
        emit(topology.shape->corners.data(), topology.shape->triangles);
    }
    return out;
}

std::span<const AmbiguousCell> AmbiguousRows::cells() const {
    const std::size_t begin = place_ == 0 ? 0 : slice().rows[place_ - 1].cells_end;
    return std::span(slice().cells).subspan(begin, slice().rows[place_].cells_end - begin);
}

void AmbiguousRows::advance() {
    ++place_;
    settle();
}

void AmbiguousRows::find(std::size_t from) {
    const GridRow at(cells_->bits_, from);
    slice_ = static_cast<std::size_t>(at.z);
    if (slice_ < cells_->slices_.size()) {
        const auto& rows = slice().rows;
        const auto first =
            std::lower_bound(rows.begin(), rows.end(), at.y,
                             [](const AmbiguousRow& row, std::int64_t y) { return row.y < y; });
        place_ = static_cast<std::size_t>(first - rows.begin());
    }
    settle();
}

bool AmbiguousRows::catch_up(std::size_t row) {
    while (row > row_) advance();
    return row == row_;
}

void AmbiguousRows::settle() {
    const auto& slices = cells_->slices_;
    for (; slice_ < slices.size() && place_ == slices[slice_].rows.size(); ++slice_) place_ = 0;
    row_ = slice_ < slices.size()
               ? cells_->bits_.row_index(slice().rows[place_].y, static_cast<std::int64_t>(slice_))
               : std::numeric_limits<std::size_t>::max();
}

}  // namespace marrow::internal
