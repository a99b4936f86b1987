// Bit logic on the rows around a row of cells, 64 cells at a time. Included once per SIMD target.
#if defined(MARROW_ROW_BITS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MARROW_ROW_BITS_INL_H
#undef MARROW_ROW_BITS_INL_H
#else
#define MARROW_ROW_BITS_INL_H
#endif

#include <cstdint>

#include "inside_bits.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

// The row's neighbours in the grid: (y + 1, z), (y, z + 1), (y + 1, z + 1).
enum Row { kRow = 0, kNextY = 1, kNextZ = 2, kNextYZ = 3 };

// The four rows of samples around a row of cells. Where the grid ends, a missing row stands for its
// neighbour, so that no edge towards it is crossed.
struct RowBits {
    const std::uint64_t* rows[4];
    std::size_t words;
    std::uint64_t last_valid;  // valid(w) of the last word
    bool has_cells;

    RowBits(const InsideBits& bits, std::size_t row) : words(bits.words_per_row) {
        const auto ny = static_cast<std::size_t>(bits.ny);
        const bool last_y = row % ny == ny - 1, last_z = row / ny == static_cast<std::size_t>(bits.nz) - 1;
        const std::size_t step_y = last_y ? 0 : 1, step_z = last_z ? 0 : ny;
        rows[kRow] = bits.row(row);
        rows[kNextY] = bits.row(row + step_y);
        rows[kNextZ] = bits.row(row + step_z);
        rows[kNextYZ] = bits.row(row + step_y + step_z);
        const std::int64_t cells_in_last_word = bits.cells_x - 64 * static_cast<std::int64_t>(words - 1);
        last_valid =
            cells_in_last_word == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << cells_in_last_word) - 1;
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

// Calls f(w, active) for every word of a row with cells that the surface passes through: those whose eight
// corners are neither all outside nor all inside.
template <class F>
HWY_INLINE void for_each_active_word(const RowBits& row, const F& f) {
    const auto any = [&](std::size_t w) {
        return row.rows[kRow][w] | row.rows[kNextY][w] | row.rows[kNextZ][w] | row.rows[kNextYZ][w];
    };
    const auto all = [&](std::size_t w) {
        return row.rows[kRow][w] & row.rows[kNextY][w] & row.rows[kNextZ][w] & row.rows[kNextYZ][w];
    };
    std::uint64_t any_here = any(0), all_here = all(0);
    for (std::size_t w = 0; w < row.words; ++w) {
        const bool last = w + 1 == row.words;
        const std::uint64_t any_next = last ? 0 : any(w + 1), all_next = last ? 0 : all(w + 1);
        const std::uint64_t some_inside = any_here | any_here >> 1 | any_next << 63;
        const std::uint64_t all_inside = all_here & (all_here >> 1 | all_next << 63);
        const std::uint64_t active = some_inside & ~all_inside & row.valid(w);
        if (active != 0) f(w, active);
        any_here = any_next;
        all_here = all_next;
    }
}

// The eight corners of 64 cells, bit-sliced: bit i of corners[v] is corner v of cell i.
struct CellBits {
    std::uint64_t corners[8];

    CellBits(const RowBits& row, std::size_t w) {
        for (int r = 0; r < 4; ++r) {
            corners[2 * r] = row.rows[r][w];
            corners[2 * r + 1] = row.next_x(static_cast<Row>(r), w);
        }
    }

    // The case of cell i.
    unsigned cell_case(int i) const {
        if (i == 63) return last_case();
        // Both ends of an edge along x lie side by side.
        const auto pair = [&](int r) { return static_cast<unsigned>(corners[2 * r] >> i & 3); };
        return pair(0) | pair(1) << 2 | pair(2) << 4 | pair(3) << 6;
    }
    unsigned last_case() const {
        unsigned c = 0;
        for (int v = 0; v < 8; ++v) c |= static_cast<unsigned>(corners[v] >> 63) << v;
        return c;
    }
};

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
