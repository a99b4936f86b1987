// Bit logic on the rows around a row of cells, 64 cells at a time. Included once per SIMD target.
#if defined(MARROW_ROW_BITS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MARROW_ROW_BITS_INL_H
#undef MARROW_ROW_BITS_INL_H
#else
#define MARROW_ROW_BITS_INL_H
#endif

#include <bit>
#include <cstdint>

#include "inside_bits.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

// As std::popcount, but unsigned as all counts are.
HWY_INLINE std::uint32_t popcount(std::uint64_t bits) {
    return static_cast<std::uint32_t>(std::popcount(bits));
}

// The row's neighbours in the grid: (y + 1, z), (y, z + 1), (y + 1, z + 1).
enum Row { kRow = 0, kNextY = 1, kNextZ = 2, kNextYZ = 3 };

// A row of the grid while rows pass by in order.
struct GridRow {
    std::size_t index;
    std::int64_t y, z;

    GridRow(const InsideBits& bits, std::size_t row)
        : index(row),
          y(static_cast<std::int64_t>(row) % bits.ny),
          z(static_cast<std::int64_t>(row) / bits.ny) {}
    void advance(const InsideBits& bits) {
        ++index;
        if (++y == bits.ny) y = 0, ++z;
    }
};

// The four rows of samples around a row of cells. Where the grid ends, a missing row stands for its
// neighbour, so that no edge towards it is crossed.
struct RowBits {
    const std::uint64_t* rows[4];
    std::size_t words;
    std::uint64_t last_valid;  // valid(w) of the last word
    bool has_cells;

    RowBits(const InsideBits& bits, const GridRow& row) : words(bits.words_per_row) {
        const bool last_y = row.y == bits.ny - 1, last_z = row.z == bits.nz - 1;
        const std::size_t step_y = last_y ? 0 : 1, step_z = last_z ? 0 : static_cast<std::size_t>(bits.ny);
        rows[kRow] = bits.row(row.index);
        rows[kNextY] = bits.row(row.index + step_y);
        rows[kNextZ] = bits.row(row.index + step_z);
        rows[kNextYZ] = bits.row(row.index + step_y + step_z);
        last_valid = bits.last_cells();
        has_cells = !last_y && !last_z;
    }

    // The bits of word w at which a cell starts, and an edge along x.
    std::uint64_t valid(std::size_t w) const { return w + 1 < words ? ~std::uint64_t{0} : last_valid; }
    // The samples one further along x, for each sample of word w.
    std::uint64_t next_x(Row r, std::size_t w) const {
        const std::uint64_t carry = w + 1 < words ? rows[r][w + 1] : 0;
        return rows[r][w] >> 1 | carry << 63;
    }
    std::uint64_t crossed_x(Row r, std::size_t w) const { return (rows[r][w] ^ next_x(r, w)) & valid(w); }
    std::uint64_t crossed_y(std::size_t w) const { return rows[kRow][w] ^ rows[kNextY][w]; }
    std::uint64_t crossed_z(std::size_t w) const { return rows[kRow][w] ^ rows[kNextZ][w]; }
};

// Calls f(w) for each active word of a row, in order.
template <class F>
HWY_INLINE void for_each_active_word(const ActiveWords& active, std::size_t row, const F& f) {
    const std::uint64_t* mask = active.row(row);
    for (std::size_t m = 0; m < active.masks_per_row; ++m) {
        for (std::uint64_t left = mask[m]; left != 0; left &= left - 1)
            f(64 * m + static_cast<std::size_t>(std::countr_zero(left)));
    }
}

// The eight corners of 64 cells, bit-sliced: bit i of corners[v] is corner v of cell i.
struct CellBits {
    alignas(64) std::uint64_t corners[8];

    CellBits(const RowBits& row, std::size_t w) {
        for (int r = 0; r < 4; ++r) {
            corners[2 * r] = row.rows[r][w];
            corners[2 * r + 1] = row.next_x(static_cast<Row>(r), w);
        }
    }
};

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
