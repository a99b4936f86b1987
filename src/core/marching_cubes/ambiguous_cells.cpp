// Finds ambiguous cells from the inside bits, and asks their samples.
#include "ambiguous_cells.h"

#include <hwy/base.h>

#include <algorithm>
#include <type_traits>
#include <utility>

#include "candidate_cells.h"
#include "core/volume/rows.h"
#include "corner_samples.h"

namespace marrow::internal {

namespace {

// Collects the ambiguous cells of a slice in the order of (y, x).
class SliceWriter {
  public:
    // Writes at most `most` cells, in at most `most_rows` rows. Adds what the loops of the cells' cases
    // subtract to `to_subtract`, by row, unless it is null.
    SliceWriter(std::size_t most, std::size_t most_rows, std::uint32_t* to_subtract,
                std::vector<AmbiguousRow>& rows, Buffer<AmbiguousCell>& cells)
        : to_subtract_(to_subtract), rows_(rows), cells_(cells) {
        rows_.clear();
        rows_.reserve(std::min(most, most_rows));
        // One more: branches on what the samples decide would often be mispredicted. So each cell is written,
        // and the next one overwrites it if it is not ambiguous.
        cells_.resize(most + 1);
    }

    // The next cells are in this row.
    void set_row(std::uint32_t y) {
        if (y == row_.y) return;
        end_row();
        row_ = {y, 0, 0, 0};
        loops_ = 0;
    }
    void add(std::uint32_t x, std::uint8_t cell_case, const CellTopology& topology) {
        int more_triangles = kShapeChanges[topology.shape_number].more_triangles;
        if (HWY_UNLIKELY(topology.has_tunnel()))
            more_triangles = topology.triangles() - kCases[cell_case].triangles;
        cells_[size_] = {x, topology};
        row_.inner_points += topology.inner_points;
        row_.more_triangles += static_cast<std::uint32_t>(more_triangles);
        size_ += topology.is_default(cell_case) ? 0 : 1;
        loops_ += kCases[cell_case].loops;
    }
    void end() {
        end_row();
        cells_.resize(size_);
    }

  private:
    void end_row() {
        if (to_subtract_ != nullptr) to_subtract_[row_.y] += 2 * loops_;
        row_.cells_end = static_cast<std::uint32_t>(size_);
        if (row_.cells_end > (rows_.empty() ? 0 : rows_.back().cells_end)) rows_.push_back(row_);
    }

    std::uint32_t* const to_subtract_;
    std::vector<AmbiguousRow>& rows_;
    Buffer<AmbiguousCell>& cells_;
    std::size_t size_ = 0;
    AmbiguousRow row_{};
    std::uint32_t loops_ = 0;  // of the row's cells, as their cases have them
};

// The samples at the corners of the cells of a slice.
template <class T>
class SliceSamples {
  public:
    SliceSamples(const VolumeView& volume, double isovalue, const InsideBits& bits, std::int64_t slice)
        : volume_(volume),
          isovalue_(isovalue),
          first_x_(bits.first_x),
          first_y_(bits.first_y),
          z_(slice - bits.first_z) {
        const auto [nx, ny, nz] = volume.geometry.dims;
        const bool within = z_ >= 0 && z_ + 1 < nz;
        inner_x_ = nx - 1;
        inner_y_ = within ? ny - 1 : 0;
        first_ = within ? row_of<T>(volume, 0, z_) : nullptr;
    }

    // Sets a cell of the batch to that which begins at bit x of row y.
    HWY_INLINE void set(CellBatch& batch, std::size_t cell, std::uint32_t bit, std::uint32_t row) const {
        const std::int64_t x = bit - first_x_, y = row - first_y_;
        if (HWY_LIKELY(x >= 0 && x < inner_x_ && y >= 0 && y < inner_y_)) {
            const T* const p = first_ + (y * volume_.row_pitch() + x);
            const std::int64_t step_y = volume_.row_pitch(), step_z = volume_.slice_pitch();
            double check = 0;  // becomes NaN if a value is not finite
            for (std::size_t v = 0; v < 8; ++v) {
                const T sample = p[static_cast<std::int64_t>(v & 1) + ((v & 2) != 0 ? step_y : 0) +
                                   ((v & 4) != 0 ? step_z : 0)];
                const double value = static_cast<double>(sample) - isovalue_;
                batch.corners[v][cell] = value;
                if constexpr (std::is_floating_point_v<T>) check += 0 * value;
            }
            if (HWY_LIKELY(check == 0)) return;
        }
        batch.set(cell, CornerSamples<T>(volume_, y, z_).minus(isovalue_, x));
    }

  private:
    const VolumeView& volume_;
    const double isovalue_;
    const std::int64_t first_x_, first_y_, z_;
    std::int64_t inner_x_, inner_y_;  // cells that have all samples
    const T* first_;
};

template <class T>
void decide(const SliceSamples<T>& samples, const CandidateCells& candidates, SliceWriter& writer) {
    CellBatch batch;
    std::uint8_t cases[CellBatch::kCells] = {};
    CellTopology topologies[CellBatch::kCells];
    for (std::size_t begin = 0; begin < candidates.size(); begin += CellBatch::kCells) {
        const std::size_t count = std::min(CellBatch::kCells, candidates.size() - begin);
        for (std::size_t i = 0; i < count; ++i) {
            samples.set(batch, i, candidates.x(begin + i), candidates.y(begin + i));
            cases[i] = candidates.cell_case(begin + i);
        }
        decide_topologies(batch, cases, count, topologies);
        for (std::size_t i = 0; i < count; ++i) {
            writer.set_row(candidates.y(begin + i));
            writer.add(candidates.x(begin + i), cases[i], topologies[i]);
        }
    }
}

}  // namespace

void AmbiguousCells::count(std::int64_t slice, RowCounts& counts, ActiveWords& active) {
    CandidateCells& candidates = candidates_.local();
    candidates.slice = slice;
    count_rows(bits_, bits_.row_index(0, slice), bits_.row_index(0, slice + 1), counts, active,
               &candidates.words);
    decide(candidates, counts.triangles.data() + bits_.row_index(0, slice));
}

bool AmbiguousCells::find_again(std::int64_t slice, const ActiveWords& active) {
    CandidateCells& candidates = candidates_.local();
    candidates.slice = slice;
    candidates.find_words(bits_, active);
    std::vector<AmbiguousRow>& rows = slices_[static_cast<std::size_t>(slice)].rows;
    const std::vector<AmbiguousRow> before = std::move(rows);
    decide(candidates, nullptr);
    return rows == before;
}

void AmbiguousCells::decide(CandidateCells& candidates, std::uint32_t* to_subtract) {
    candidates.list_cells(volume_, bits_);
    Slice& slice = slices_[static_cast<std::size_t>(candidates.slice)];
    SliceWriter writer(candidates.size(), static_cast<std::size_t>(bits_.ny), to_subtract, slice.rows,
                       slice.cells);
    visit_sample_type(volume_.type, [&](auto sample) {
        const SliceSamples<decltype(sample)> samples(volume_, isovalue_, bits_, candidates.slice);
        internal::decide(samples, candidates, writer);
    });
    writer.end();
}

void AmbiguousCells::forget(std::int64_t slice) {
    Slice& kept = slices_[static_cast<std::size_t>(slice)];
    kept.cells = Buffer<AmbiguousCell>();  // `= {}` would keep the memory
    kept.rows.shrink_to_fit();
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
