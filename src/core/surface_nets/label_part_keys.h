/// The keys by which points of different parts are the same, and by which points and
/// triangles are ordered as in the whole.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include <marrow/error.h>

#include "surface_net.h"

namespace marrow::internal {

/// Keys of a whole map. Cells have the indices of borders.h.
class LabelPartKeys {
  public:
    /// \throw LimitError the keys do not fit in 64 bits
    explicit LabelPartKeys(const Index3& whole)
        : nx_(static_cast<std::uint64_t>(whole[0]) + 1), ny_(static_cast<std::uint64_t>(whole[1]) + 1) {
        std::uint64_t keys = 4 * kPoints;
        for (const std::int64_t n : {whole[0] + 1, whole[1] + 1, whole[2] + 1 + SlabOfCells::kSlices}) {
            if (__builtin_mul_overflow(keys, static_cast<std::uint64_t>(n), &keys))
                throw LimitError("the label map has more points than 64 bits can number; crop or coarsen it");
        }
    }

    /// A point of the net: the first points of cells come before their further ones.
    std::uint64_t net_point(const Index3& cell, std::uint64_t number) const {
        return (number > 0 ? std::uint64_t{1} << 63 : 0) | (index(cell) * kPoints + number);
    }

    /// A point of a label. As slabs write them, those of two-label cells come
    /// before those of multi-label cells.
    std::uint64_t label_point(const Index3& cell, bool multi_label, std::uint64_t number) const {
        const Index3 in_slab{cell[0], cell[1], cell[2] % SlabOfCells::kSlices};
        const std::uint64_t run =
            2 * static_cast<std::uint64_t>(cell[2] / SlabOfCells::kSlices) + (multi_label ? 1 : 0);
        return (run * slab_cells() + index(in_slab)) * kPoints + number;
    }

    /// The cell of a label_point().
    Index3 cell_of(std::uint64_t label_point) const {
        const std::uint64_t cell = label_point / kPoints, run = cell / slab_cells(),
                            in_slab = cell % slab_cells();
        return {static_cast<std::int64_t>(in_slab % nx_), static_cast<std::int64_t>(in_slab / nx_ % ny_),
                static_cast<std::int64_t>(run / 2) * SlabOfCells::kSlices +
                    static_cast<std::int64_t>(in_slab / nx_ / ny_)};
    }

  private:
    static constexpr std::uint64_t kPoints = 64;  // more than a cell has
    static_assert(kPoints > CellPattern::kMaxLabelPoints);

    std::uint64_t index(const Index3& cell) const {
        return (static_cast<std::uint64_t>(cell[2]) * ny_ + static_cast<std::uint64_t>(cell[1])) * nx_ +
               static_cast<std::uint64_t>(cell[0]);
    }
    std::uint64_t slab_cells() const { return nx_ * ny_ * static_cast<std::uint64_t>(SlabOfCells::kSlices); }

    const std::uint64_t nx_, ny_;  // cells
};

/// The row (j, k) of samples in which the edge of a triangle begins, given the cells of its corners. These
/// are around the edge, and one of them has the highest j and k.
struct EdgeRow {
    std::int64_t j, k;

    static EdgeRow of(const Index3& a, const Index3& b, const Index3& c) {
        return {std::max({a[1], b[1], c[1]}), std::max({a[2], b[2], c[2]})};
    }
    /// Ascending in the order in which make_label_meshes() writes rows: the first slice of a slab comes last.
    std::array<std::int64_t, 3> order() const {
        const std::int64_t slices = SlabOfCells::kSlices;
        return {k / slices, k % slices == 0 ? slices : k % slices, j};
    }
};

}  // namespace marrow::internal
