#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "count.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "case_table.h"
#include "count.h"
#include "row_bits-inl.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

HWY_INLINE std::uint32_t popcount(std::uint64_t bits) {
    return static_cast<std::uint32_t>(__builtin_popcountll(bits));
}

std::uint32_t count_points(const RowBits& row) {
    std::uint32_t points = 0;
    for (std::size_t w = 0; w < row.words; ++w) {
        points += popcount(row.crossed_x(kRow, w)) + popcount(row.crossed_y(w)) + popcount(row.crossed_z(w));
    }
    return points;
}

// Triangles of 64 cells, without looking at any one of them.
//
// A loop of k points makes k - 2 triangles, so a cell with E crossed edges and L loops makes E - 2 L. The
// loops divide the cell's boundary into one region more than there are loops: L = (inside regions) + (outside
// regions) - 1. Inside corners hang together along edges only, so an inside region is either a lone corner,
// or the one that the other inside corners make; two of that sort are possible only as two diagonally
// opposite edges. Outside corners hang together across face diagonals too, so only a corner and its antipode,
// alone, make two outside regions.
HWY_INLINE std::uint32_t count_triangles(const CellBits& cells) {
    const auto& c = cells.corners;
    std::uint32_t crossed = 0, loops = 0;
    for (const auto& edge : kEdgeCorners) crossed += popcount((c[edge[0]] ^ c[edge[1]]) & cells.active);

    std::uint64_t joined = 0;  // cells with an inside corner that has an inside neighbour
    for (unsigned v = 0; v < 8; ++v) {
        const std::uint64_t neighbours = c[v ^ 1] | c[v ^ 2] | c[v ^ 4];
        loops += popcount(c[v] & ~neighbours & cells.active);
        joined |= c[v] & neighbours;
    }
    loops += popcount(joined & cells.active);

    for (unsigned axis = 1; axis < 8; axis <<= 1) {
        // The four edges along the axis, in a ring; u and w span its plane.
        const unsigned u = axis == 1 ? 2 : 1, w = axis == 4 ? 2 : 4;
        const auto both = [&](unsigned v) { return c[v] & c[v | axis]; };
        const auto none = [&](unsigned v) { return ~(c[v] | c[v | axis]); };
        const std::uint64_t opposite =
            (both(0) & both(u | w) & none(u) & none(w)) | (both(u) & both(w) & none(0) & none(u | w));
        loops += popcount(opposite & cells.active);
    }
    for (unsigned v = 0; v < 4; ++v) {
        std::uint64_t antipodes_alone = ~(c[v] | c[7 - v]);
        for (unsigned other = 0; other < 8; ++other) {
            if (other != v && other != 7 - v) antipodes_alone &= c[other];
        }
        loops += popcount(antipodes_alone & cells.active);
    }
    return crossed - 2 * loops;
}

std::uint32_t count_triangles(const RowBits& row) {
    if (!row.has_cells) return 0;
    std::uint32_t triangles = 0;
    for (std::size_t w = 0; w < row.words; ++w) {
        const CellBits cells(row, w);
        if (cells.active != 0) triangles += count_triangles(cells);
    }
    return triangles;
}

void count_rows_target(const InsideBits& bits, std::size_t row_begin, std::size_t row_end,
                       std::uint32_t* points, std::uint32_t* triangles) {
    for (std::size_t r = row_begin; r < row_end; ++r) {
        const RowBits row(bits, r);
        points[r] = count_points(row);
        // A row of cells whose own row of samples is all alike may still be crossed by its neighbours' edges.
        triangles[r] = count_triangles(row);
    }
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(count_rows_target);

void count_rows(const InsideBits& bits, std::size_t row_begin, std::size_t row_end, std::uint32_t* points,
                std::uint32_t* triangles) noexcept {
    HWY_DYNAMIC_DISPATCH(count_rows_target)(bits, row_begin, row_end, points, triangles);
}

}  // namespace marrow::internal
#endif
