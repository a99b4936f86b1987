// Triangles are counted without looking at any one cell.
//
// A loop of k points makes k - 2 triangles, so cells with E crossed edges and L loops between them make E - 2
// L. E: every crossed edge is a point of some row; seen from a row of cells, those along x count once and
// those along y and z twice, but at the row's two ends. L: the loops divide a cell's boundary into one region
// more than there are loops, so L = (inside regions) + (outside regions) - 1: nearly always 1, and otherwise
// again bit logic.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "count.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>

#include "count.h"
#include "row_bits-inl.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

HWY_INLINE std::uint32_t popcount(std::uint64_t bits) {
    return static_cast<std::uint32_t>(__builtin_popcountll(bits));
}

// Of 64 cells, those that may have more than one loop. That takes a face with all four edges crossed, or a
// corner and its antipode alone against the other six, where of the edges along x two diagonally opposite
// ones are crossed.
HWY_INLINE std::uint64_t may_have_loops(const CellBits& cells) {
    const auto& c = cells.corners;
    const std::uint64_t x[4] = {c[0] ^ c[1], c[2] ^ c[3], c[4] ^ c[5], c[6] ^ c[7]};
    const std::uint64_t faces_along_x = (x[0] & x[1] & (c[0] ^ c[2])) | (x[2] & x[3] & (c[4] ^ c[6])) |
                                        (x[0] & x[2] & (c[0] ^ c[4])) | (x[1] & x[3] & (c[2] ^ c[6]));
    const std::uint64_t faces_across_x =
        ((c[0] ^ c[2]) & (c[4] ^ c[6]) & (c[0] ^ c[4])) | ((c[1] ^ c[3]) & (c[5] ^ c[7]) & (c[1] ^ c[5]));
    const std::uint64_t antipodes = (x[0] & x[3] & ~x[1] & ~x[2]) | (x[1] & x[2] & ~x[0] & ~x[3]);
    return faces_along_x | faces_across_x | antipodes;
}

// Loops of the active ones of 64 cells. Inside corners hang together along edges only, so an inside region is
// either a lone corner, or the one that the other inside corners make; two of that sort are possible only as
// two diagonally opposite edges. Outside corners hang together across face diagonals too, so only a corner
// and its antipode, alone, make two outside regions.
std::uint32_t count_loops(const CellBits& cells, std::uint64_t active) {
    const auto& c = cells.corners;
    std::uint32_t loops = 0;
    std::uint64_t joined = 0;  // cells with an inside corner that has an inside neighbour
    for (unsigned v = 0; v < 8; ++v) {
        const std::uint64_t neighbours = c[v ^ 1] | c[v ^ 2] | c[v ^ 4];
        loops += popcount(c[v] & ~neighbours & active);
        joined |= c[v] & neighbours;
    }
    loops += popcount(joined & active);

    for (unsigned axis = 1; axis < 8; axis <<= 1) {
        // The four edges along the axis, in a ring; u and w span its plane.
        const unsigned u = axis == 1 ? 2 : 1, w = axis == 4 ? 2 : 4;
        const auto both = [&](unsigned v) { return c[v] & c[v | axis]; };
        const auto none = [&](unsigned v) { return ~(c[v] | c[v | axis]); };
        loops += popcount(both(0) & both(u | w) & none(u) & none(w) & active);
        loops += popcount(both(u) & both(w) & none(0) & none(u | w) & active);
    }
    for (unsigned v = 0; v < 4; ++v) {
        std::uint64_t antipodes_alone = ~(c[v] | c[7 - v]) & active;
        for (unsigned other = 0; other < 8; ++other) {
            if (other != v && other != 7 - v) antipodes_alone &= c[other];
        }
        loops += popcount(antipodes_alone);
    }
    return loops;
}

// Loops in the cells of word w.
HWY_INLINE std::uint32_t count_loops(const RowBits& row, std::size_t w) {
    const CellBits cells(row, w);
    const std::uint64_t active = cells.active() & row.valid(w);
    if (HWY_LIKELY((may_have_loops(cells) & active) == 0)) return popcount(active);
    return count_loops(cells, active);
}

// Marks the words of a row in which any of its edges may be crossed or its cells be active: where the four
// rows differ at a sample or the one behind, or the row itself changes. At a row's end that may mark a word
// for what follows in memory, which costs a look and no more. \returns whether any is marked
HWY_INLINE bool mark_active_words(const RowBits& row, std::uint64_t* HWY_RESTRICT mask) {
    const hn::ScalableTag<std::uint64_t> d;
    constexpr std::size_t kLanes = hn::MaxLanes(d);
    static_assert(kLanes <= InsideBits::kSlack);
    std::uint64_t any = 0;
    for (std::size_t begin = 0; begin < row.words; begin += 64) {
        const std::size_t count = std::min<std::size_t>(64, row.words - begin);
        std::uint64_t marked = 0;
        for (std::size_t w = 0; w < count; w += kLanes) {
            const auto load = [&](Row r, std::size_t i)
                                  HWY_ATTR { return hn::LoadU(d, row.rows[r] + begin + i); };
            const auto difference = [&](std::size_t i) HWY_ATTR {
                const auto here = load(kRow, i);
                return hn::Or(hn::Or(hn::Xor(here, load(kNextY, i)), hn::Xor(here, load(kNextZ, i))),
                              hn::Xor(here, load(kNextYZ, i)));
            };
            const auto here = load(kRow, w);
            const auto next_x = hn::Or(hn::ShiftRight<1>(here), hn::ShiftLeft<63>(load(kRow, w + 1)));
            const auto differs = difference(w);
            const auto active =
                hn::Or(hn::Or(differs, hn::ShiftLeft<63>(difference(w + 1))), hn::Xor(here, next_x));
            std::uint64_t bits = 0;
            hn::StoreMaskBits(d, hn::Ne(active, hn::Zero(d)), reinterpret_cast<std::uint8_t*>(&bits));
            marked |= bits << w;
        }
        marked &= ~std::uint64_t{0} >> (64 - count);
        mask[begin / 64] = marked;
        any |= marked;
    }
    return any != 0;
}

// The crossed edges along y and z that only one cell of the row has: those at the bits where its cells start
// and end.
std::uint32_t count_ends(const RowBits& row, std::int64_t cells_x) {
    std::uint32_t ends = 0;
    for (const std::int64_t x : {std::int64_t{0}, cells_x}) {
        if (x == 64 * static_cast<std::int64_t>(row.words))
            continue;  // behind the samples of a closed surface
        const auto at = [&](Row r) { return row.rows[r][x / 64] >> (x % 64); };
        ends += (at(kRow) ^ at(kNextY)) & 1;
        ends += (at(kRow) ^ at(kNextZ)) & 1;
        ends += (at(kNextZ) ^ at(kNextYZ)) & 1;
        ends += (at(kNextY) ^ at(kNextYZ)) & 1;
    }
    return ends;
}

void count_rows_target(const InsideBits& bits, std::size_t row_begin, std::size_t row_end, RowCounts& counts,
                       ActiveWords& active) {
    for (std::size_t r = row_begin; r < row_end; ++r) {
        const RowBits row(bits, r);
        std::uint32_t along_x = 0, along_y = 0, along_z = 0, loops = 0, ends = 0;
        if (mark_active_words(row, active.row(r))) {
            for_each_active_word(active, r, [&](std::size_t w) HWY_ATTR {
                along_x += popcount(row.crossed_x(kRow, w));
                along_y += popcount(row.crossed_y(w));
                along_z += popcount(row.crossed_z(w));
                loops += count_loops(row, w);
            });
            ends = count_ends(row, bits.cells_x);
        }
        counts.points[r] = along_x + along_y + along_z;
        counts.along_x[r] = along_x;
        counts.along_y[r] = along_y;
        counts.triangles[r] = row.has_cells ? 2 * loops + ends : 0;
    }
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(count_rows_target);

void count_rows(const InsideBits& bits, std::size_t row_begin, std::size_t row_end, RowCounts& counts,
                ActiveWords& active) noexcept {
    HWY_DYNAMIC_DISPATCH(count_rows_target)(bits, row_begin, row_end, counts, active);
}

void count_triangles(const InsideBits& bits, std::size_t row_begin, std::size_t row_end,
                     RowCounts& counts) noexcept {
    const auto ny = static_cast<std::size_t>(bits.ny);
    const auto& x = counts.along_x;
    const auto& y = counts.along_y;
    const auto along_z = [&](std::size_t r) { return counts.points[r] - x[r] - y[r]; };
    for (std::size_t r = row_begin; r < row_end; ++r) {
        const std::uint32_t to_subtract = counts.triangles[r];
        if (to_subtract == 0) continue;  // no loop: no triangle
        const std::uint32_t crossed = x[r] + x[r + 1] + x[r + ny] + x[r + ny + 1] + 2 * (y[r] + y[r + ny]) +
                                      2 * (along_z(r) + along_z(r + 1));
        counts.triangles[r] = crossed - to_subtract;
    }
}

}  // namespace marrow::internal
#endif
