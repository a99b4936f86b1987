// Counts points and triangles with bit logic, 64 cells at a time and without looking at single cells.
//
// A loop of k points makes k - 2 triangles. So cells with E crossed edges and L loops make E - 2 L triangles.
//
// E: every crossed edge has a point in some row. Among the edges of a row of cells, each edge along x belongs
// to one cell, and each edge along y or z to two, except at the ends of the row.
//
// L: the loops divide the boundary of a cell into one region more than there are loops. So L = (inside
// regions) + (outside regions) - 1. This is nearly always 1, and the other cases follow from bit logic too.
#define HWY_WANT_AVX3_DL 1  // which counts bits with one instruction
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/marching_cubes/count.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>

#include "count.h"
#include "row_bits-inl.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

// Counts the loops of those of 64 cells that `which` selects. All of them must be active. Inside corners are
// connected along edges only. So an inside region is either a single corner, or all inside corners that have
// an inside neighbour; only two diagonally opposite edges make two regions of that kind. Outside corners are
// connected across face diagonals too. So only two antipodal outside corners, with six inside ones, make two
// outside regions.
std::uint32_t count_loops(const CellBits& cells, std::uint64_t which) {
    const auto& c = cells.corners;
    std::uint32_t loops = 0;
    std::uint64_t connected = 0;  // cells with an inside corner that has an inside neighbour
    for (unsigned v = 0; v < 8; ++v) {
        const std::uint64_t neighbours = c[v ^ 1] | c[v ^ 2] | c[v ^ 4];
        loops += popcount(c[v] & ~neighbours & which);
        connected |= c[v] & neighbours;
    }
    loops += popcount(connected & which);

    for (unsigned axis = 1; axis < 8; axis <<= 1) {
        // The four edges along the axis begin at corners 0, u, u | w and w.
        const unsigned u = axis == 1 ? 2 : 1, w = axis == 4 ? 2 : 4;
        const auto both = [&](unsigned v) { return c[v] & c[v | axis]; };
        const auto none = [&](unsigned v) { return ~(c[v] | c[v | axis]); };
        loops += popcount(both(0) & both(u | w) & none(u) & none(w) & which);
        loops += popcount(both(u) & both(w) & none(0) & none(u | w) & which);
    }
    for (unsigned v = 0; v < 4; ++v) {
        std::uint64_t antipodes_alone = ~(c[v] | c[7 - v]) & which;
        for (unsigned other = 0; other < 8; ++other) {
            if (other != v && other != 7 - v) antipodes_alone &= c[other];
        }
        loops += popcount(antipodes_alone);
    }
    return loops;
}

// Counts the crossed edges along y and z that belong to only one cell of the row: those at both ends of the
// row.
HWY_INLINE std::uint32_t count_ends(const RowBits& row, std::int64_t cells_x) {
    const auto ends_at = [&](std::size_t bit) {
        const auto at = [&](Row r) { return row.rows[r][bit / 64] >> (bit % 64) & 1; };
        return static_cast<std::uint32_t>((at(kRow) ^ at(kNextY)) + (at(kRow) ^ at(kNextZ)) +
                                          (at(kNextZ) ^ at(kNextYZ)) + (at(kNextY) ^ at(kNextYZ)));
    };
    const auto end = static_cast<std::size_t>(cells_x);
    // If the last word of a closed surface is full, there is no word after its samples.
    return ends_at(0) + (end < 64 * row.words ? ends_at(end) : 0);
}

// The bits of a row's words that are samples, and those that are cells. The words after the row are 0.
struct RowMasks {
    Buffer<std::uint64_t> samples, cells;

    explicit RowMasks(const InsideBits& bits) {
        for (Buffer<std::uint64_t>* masks : {&samples, &cells}) {
            masks->resize(bits.words_per_row + InsideBits::kSlack);
            std::fill(masks->begin(), masks->end(), std::uint64_t{0});
            std::fill_n(masks->begin(), bits.words_per_row, ~std::uint64_t{0});
        }
        cells[bits.words_per_row - 1] = bits.last_cells();
    }
};

// The bits that are set in each word.
HWY_INLINE WordVec count_bits(WordVec words) {
#if HWY_TARGET == HWY_WASM
    // Highway looks up half bytes, although there is an instruction for words outside vectors.
    const v128_t w = words.raw;
    return WordVec{
        wasm_u64x2_make(popcount(wasm_u64x2_extract_lane(w, 0)), popcount(wasm_u64x2_extract_lane(w, 1)))};
#else
    return hn::PopulationCount(words);
#endif
}

// Counts what a row makes, in the lanes of vectors, and marks its active words.
struct RowCounter {
    WordVec along_x, along_y, along_z;
    WordVec one_loop;  // active cells that are not undecided

    RowCounter() {
        const Words d;
        along_x = along_y = along_z = one_loop = hn::Zero(d);
    }

    // Counts in a vector of words, of which w is the first. Returns a bit for each word that is active. Calls
    // note(word, cells) for the words that have undecided cells, and perhaps for others, with no cells.
    template <class Note>
    HWY_INLINE std::uint64_t count(const RowBits& row, const RowMasks& masks, std::size_t w,
                                   const Note& note) {
        const Words d;
        const CellVecs cells(row, w);
        const auto& c = cells.corners;
        const auto samples = hn::LoadU(d, masks.samples.data() + w);
        const auto valid = hn::LoadU(d, masks.cells.data() + w);
        const auto x = hn::And(hn::Xor(c[0], c[1]), valid);
        const auto y = hn::And(hn::Xor(c[0], c[2]), samples);
        const auto z = hn::And(hn::Xor(c[0], c[4]), samples);
        const auto active = hn::And(cells.active(), valid);
        const auto any = hn::Or(hn::Or(x, y), hn::Or(z, active));
        const std::uint64_t marks = bits_of(hn::Ne(any, hn::Zero(d)));
        if (marks == 0) return 0;
        along_x = hn::Add(along_x, count_bits(x));
        along_y = hn::Add(along_y, count_bits(y));
        along_z = hn::Add(along_z, count_bits(z));
        const auto undecided = hn::And(may_be_ambiguous(cells), valid);
        one_loop = hn::Add(one_loop, count_bits(hn::AndNot(undecided, active)));
        if (HWY_UNLIKELY(!hn::AllFalse(d, hn::Ne(undecided, hn::Zero(d))))) {
            HWY_ALIGN std::uint64_t of_word[hn::MaxLanes(Words())];
            hn::Store(undecided, d, of_word);
            for (std::size_t k = 0; k < hn::Lanes(d); ++k) note(w + k, of_word[k]);
        }
        return marks;
    }

    static std::uint64_t bits_of(hn::Mask<Words> mask) {
#if HWY_TARGET == HWY_WASM
        return wasm_i64x2_bitmask(hn::VecFromMask(Words(), mask).raw);
#else
        std::uint64_t bits = 0;
        hn::StoreMaskBits(Words(), mask, reinterpret_cast<std::uint8_t*>(&bits));
        return bits;
#endif
    }
    static std::uint32_t sum(WordVec counts) {
        return static_cast<std::uint32_t>(hn::GetLane(hn::SumOfLanes(Words(), counts)));
    }
};

void count_rows_target(const InsideBits& bits, std::size_t row_begin, std::size_t row_end, RowCounts& counts,
                       ActiveWords& active, Buffer<UndecidedCells>* undecided) {
    constexpr std::size_t kLanes = hn::MaxLanes(Words());
    static_assert(kLanes < InsideBits::kSlack);
    const RowMasks masks(bits);
    // Branches on which words have undecided cells would often be mispredicted. So each word is written, and
    // the next one overwrites it if it has none.
    Buffer<UndecidedCells> of_row;
    Buffer<UndecidedCells>& list = undecided != nullptr ? *undecided : of_row;
    list.resize((undecided != nullptr ? row_end - row_begin : 1) * bits.words_per_row + 1);
    UndecidedCells* next = list.data();
    for (GridRow at(bits, row_begin); at.index < row_end; at.advance(bits)) {
        const std::size_t r = at.index;
        const RowBits row(bits, at);
        RowCounter counter;
        UndecidedCells* const first = next;
        std::uint64_t any = 0;
        for (std::size_t begin = 0; begin < row.words; begin += 64) {
            std::uint64_t marks = 0;
            for (std::size_t w = begin; w < std::min(begin + 64, row.words); w += kLanes) {
                const auto note = [&](std::size_t word, std::uint64_t cells) HWY_ATTR {
                    *next = {static_cast<std::uint32_t>(at.y), static_cast<std::uint32_t>(word), cells};
                    next += cells != 0 ? 1 : 0;
                };
                marks |= counter.count(row, masks, w, note) << (w - begin);
            }
            active.row(r)[begin / 64] = marks;
            any |= marks;
        }
        std::uint32_t along_x = 0, along_y = 0, along_z = 0, to_subtract = 0;
        if (any != 0) {
            along_x = RowCounter::sum(counter.along_x);
            along_y = RowCounter::sum(counter.along_y);
            along_z = RowCounter::sum(counter.along_z);
            std::uint32_t loops = RowCounter::sum(counter.one_loop);
            if (undecided == nullptr) {
                for (const UndecidedCells* some = first; some < next; ++some)
                    loops += count_loops(CellBits(row, some->word), some->cells);
            }
            to_subtract = 2 * loops + count_ends(row, bits.cells_x);
        }
        counts.points[r] = along_x + along_y + along_z;
        counts.along_x[r] = along_x;
        counts.along_y[r] = along_y;
        counts.triangles[r] = row.has_cells ? to_subtract : 0;
        if (undecided == nullptr || !row.has_cells) next = first;
    }
    list.resize(static_cast<std::size_t>(next - list.data()));
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(count_rows_target);

void count_rows(const InsideBits& bits, std::size_t row_begin, std::size_t row_end, RowCounts& counts,
                ActiveWords& active, Buffer<UndecidedCells>* undecided) {
    HWY_DYNAMIC_DISPATCH(count_rows_target)(bits, row_begin, row_end, counts, active, undecided);
}

void count_triangles(const InsideBits& bits, std::size_t row_begin, std::size_t row_end,
                     RowCounts& counts) noexcept {
    const auto ny = static_cast<std::size_t>(bits.ny);
    const auto& x = counts.along_x;
    const auto& y = counts.along_y;
    const auto along_z = [&](std::size_t r) { return counts.points[r] - x[r] - y[r]; };
    for (std::size_t r = row_begin; r < row_end; ++r) {
        const std::uint32_t to_subtract = counts.triangles[r];
        if (to_subtract == 0) continue;  // no loops, so no triangles
        const std::uint32_t crossed = x[r] + x[r + 1] + x[r + ny] + x[r + ny + 1] + 2 * (y[r] + y[r + ny]) +
                                      2 * (along_z(r) + along_z(r + 1));
        counts.triangles[r] = crossed - to_subtract;
    }
}

}  // namespace marrow::internal
#endif
