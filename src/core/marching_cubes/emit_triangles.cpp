// Writes the triangles of active cells, with the ids of their points counted instead of looked up.
#define HWY_WANT_AVX3_DL 1  // which lists cases without branches
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/marching_cubes/emit_triangles.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <type_traits>

#include "case_table.h"
#include "cell_rows-inl.h"
#include "emit.h"
#include "row_bits-inl.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

// The ids of the first points on the edges along x, y and z of a row of samples.
struct RowIds {
    std::uint32_t x, y, z;
};

constexpr std::size_t kIds = 16;  // that are written for each cell: whole vectors

#if HWY_TARGET == HWY_WASM

// A RunningCase for shuffles: which bytes of the lower and of the upper four counters the first twelve ids
// consist of, and what is added to these.
struct alignas(64) EmittedCase {
    std::uint8_t lower[3][16], upper[3][16];
    std::uint32_t added[3][4];
    std::uint32_t advance[8];
    RunningCase running;
    std::uint32_t triangles;
};

EmittedCase emitted_case(const RunningCase& c) {
    EmittedCase e{.running = c, .triangles = c.triangles};
    for (std::size_t k = 0; k < 12; ++k) {
        const unsigned counter = c.ids[k] & 7u;
        for (std::size_t byte = 0; byte < 4; ++byte) {
            constexpr unsigned kNone = 0x80;
            const auto index = static_cast<std::uint8_t>(4 * (counter % 4) + byte);
            e.lower[k / 4][4 * (k % 4) + byte] = counter < 4 ? index : kNone;
            e.upper[k / 4][4 * (k % 4) + byte] = counter < 4 ? kNone : index;
        }
        e.added[k / 4][k % 4] = c.ids[k] >> 3;
    }
    std::copy_n(c.advance, 8, e.advance);
    return e;
}

const EmittedCase* emitted_cases(bool mirrored) {
    const auto all = [](const std::array<RunningCase, 256>& cases) {
        std::array<EmittedCase, 256> emitted;
        std::transform(cases.begin(), cases.end(), emitted.begin(), emitted_case);
        return emitted;
    };
    static const auto kCases = all(kRunningCases), kMirrored = all(kMirroredRunningCases);
    return mirrored ? kMirrored.data() : kCases.data();
}

#else

using EmittedCase = RunningCase;

const EmittedCase* emitted_cases(bool mirrored) {
    return mirrored ? kMirroredRunningCases.data() : kRunningCases.data();
}

#endif

// The ids of the points on the edges of a cell, while a row of cells passes by.
//
// Every point on the edges around a row of cells belongs to the next active cell, so ids are never looked up.
// Eight counters advance with the cells, one for each of the cell's edges except those at its far x. A
// crossed edge uses its counter and advances it. The crossed edges along y and z at the far x have the
// counters' next values. The edges are numbered (see core/grid/cell.h) so that edge e < 8 has counter e.
class RunningIds {
  public:
    RunningIds(const RowIds& row, const RowIds& next_y, const RowIds& next_z, const RowIds& next_yz)
        : counters_{row.x, next_y.x, next_z.x, next_yz.x, row.y, next_z.y, row.z, next_y.z} {
        if constexpr (kCounters == 16)
            for (std::size_t e = 0; e < 8; ++e) counters_[8 + e] = counters_[e] + 1;
    }

    // Writes kIds ids, of which the first are those of the cell's triangles, and moves on to the next active
    // cell.
    HWY_INLINE void write(const EmittedCase& c, std::uint32_t* HWY_RESTRICT out) {
#if HWY_TARGET == HWY_WASM
        const v128_t lower = wasm_v128_load(counters_), upper = wasm_v128_load(counters_ + 4);
        for (std::size_t k = 0; k < 3; ++k) {
            const v128_t ids = wasm_v128_or(wasm_i8x16_swizzle(lower, wasm_v128_load(c.lower[k])),
                                            wasm_i8x16_swizzle(upper, wasm_v128_load(c.upper[k])));
            wasm_v128_store(out + 4 * k, wasm_i32x4_add(ids, wasm_v128_load(c.added[k])));
        }
        // Few cases have a fifth triangle.
        if (HWY_UNLIKELY(c.triangles > 4)) write_ids<3 * kMaxTriangles>(c.running.ids, out);
        wasm_v128_store(counters_, wasm_i32x4_add(lower, wasm_v128_load(c.advance)));
        wasm_v128_store(counters_ + 4, wasm_i32x4_add(upper, wasm_v128_load(c.advance + 4)));
#else
        write_ids<3 * kMaxTriangles>(c.ids, out);
        advance(c.advance);
#endif
    }
    // The same for a case or a shape, and up to RunningShape::kIds ids.
    HWY_INLINE void write(const RunningShape& s, std::uint32_t* HWY_RESTRICT out) {
        write_ids<kIds>(s.ids, out);
        if (HWY_UNLIKELY(s.triangles > kMaxTriangles)) write_ids<kIds>(s.ids + kIds, out + kIds);
        advance(s.advance);
    }

    // Writes the ids of a cell's edges, of which only those of crossed edges have a meaning, and moves on to
    // the next active cell.
    void write_edges(unsigned crossed, std::uint32_t (&ids)[kCellEdges]) {
        for (unsigned e = 0; e < 8; ++e) ids[e] = counters_[e];
        for (unsigned e = 0; e < kCounters; ++e) counters_[e] += crossed >> e % 8 & 1;
        for (unsigned e = 8; e < kCellEdges; ++e) ids[e] = counters_[e - 4];
    }

  private:
    // At least kCount ids, and at most kIds.
    template <std::size_t kCount>
    HWY_INLINE void write_ids(const std::uint8_t* HWY_RESTRICT from, std::uint32_t* HWY_RESTRICT out) const {
#if HWY_CAP_GE512
        const hn::FixedTag<std::uint32_t, 16> d;
        const auto ids = hn::PromoteTo(d, hn::Load(hn::FixedTag<std::uint8_t, 16>(), from));
        hn::StoreU(hn::TableLookupLanes(hn::Load(d, counters_), hn::IndicesFromVec(d, ids)), d, out);
#elif HWY_CAP_GE256
        const hn::FixedTag<std::uint32_t, 8> d;
        const hn::FixedTag<std::uint8_t, 8> d8;
        const auto counters = hn::Load(d, counters_);
        for (std::size_t k = 0; k < kIds; k += 8) {
            const auto id = hn::PromoteTo(d, hn::Load(d8, from + k));
            const auto counter = hn::IndicesFromVec(d, hn::And(id, hn::Set(d, 7)));
            hn::StoreU(hn::Add(hn::TableLookupLanes(counters, counter), hn::ShiftRight<3>(id)), d, out + k);
        }
#else
        for (std::size_t k = 0; k < kCount; ++k) out[k] = counters_[from[k] & 7] + (from[k] >> 3);
#endif
    }
    // Moves on to the next active cell.
    HWY_INLINE void advance(const std::uint8_t* HWY_RESTRICT by) {
#if HWY_CAP_GE256
        const hn::FixedTag<std::uint32_t, kCounters> d;
        const hn::FixedTag<std::uint8_t, kCounters> d8;
        hn::Store(hn::Add(hn::Load(d, counters_), hn::PromoteTo(d, hn::Load(d8, by))), d, counters_);
#else
        for (std::size_t e = 0; e < 8; ++e) counters_[e] += by[e];
#endif
    }

    // If vectors hold sixteen, each counter plus one follows the eight counters.
    static constexpr std::size_t kCounters = HWY_CAP_GE512 ? 16 : 8;
    alignas(64) std::uint32_t counters_[kCounters];
};

// Lists the cases of a row's active cells. Calls note(w, active cells, end of the list) before those of each
// word. Returns the end of the list.
template <class Note>
HWY_INLINE std::uint8_t* list_cases(const ActiveWords& active_words, std::size_t r, const RowBits& row,
                                    std::uint8_t* HWY_RESTRICT list, const Note& note) {
    for_each_active_word(active_words, r, [&](std::size_t w) HWY_ATTR {
        const CellRows cells(row, w);
        const std::uint64_t active = cells.active() & row.valid(w);
        note(w, active, list);
        list = cells.list(active, list);
    });
    return list;
}

// Writes the triangles of cells that follow each other in a row: a list of numbers into a table of cases or
// of shapes. `end` is the end of the memory that may be written.
template <class Number, class Entry>
HWY_INLINE std::uint32_t* emit_cells(const Number* first, const Number* last, RunningIds& running_ids,
                                     const Entry* table, std::uint32_t* HWY_RESTRICT out,
                                     const std::uint32_t* end) {
    constexpr std::size_t kMost = std::is_same_v<Entry, RunningShape> ? RunningShape::kIds : kIds;
    RunningIds ids = running_ids;
    // Each cell writes up to kMost ids, and the next cell overwrites those beyond its triangles. Near the end
    // of the share this is not allowed, because another thread writes there.
    const Number* const fast_end =
        end - out >= static_cast<std::ptrdiff_t>(kMost) * (last - first) ? last : first;
    for (; first < fast_end; ++first) {
        const Entry& c = table[*first];
        ids.write(c, out);
        out += 3 * c.triangles;
    }
    for (; first < last; ++first) {
        const Entry& c = table[*first];
        std::uint32_t triangles[kMost];
        ids.write(c, triangles);
        out = std::copy_n(triangles, 3 * c.triangles, out);
    }
    running_ids = ids;
    return out;
}

// Writes the triangles of rows that have ambiguous cells. Their shapes take the places of their cases in the
// list, so that only cells with inner points interrupt it.
class AmbiguousRowWriter {
  public:
    explicit AmbiguousRowWriter(const EmitInput& input)
        : input_(input),
          table_(input.to_physical.mirrored ? kMirroredRunningShapes.data() : kRunningShapes.data()),
          words_(input.ambiguous != nullptr ? input.bits.words_per_row : 0),
          list_(64 * words_.size() + hn::MaxLanes(D16())) {}

    // `inner_id` is the id of the row's first inner point, and `cases` has room for the row's cases.
    std::uint32_t* emit(const AmbiguousRows& at, const RowBits& row, RunningIds& ids, std::uint32_t inner_id,
                        std::uint8_t* cases, std::uint32_t* out, const std::uint32_t* end) {
        const std::uint8_t* const cases_end =
            list_cases(input_.active, at.row(), row, cases,
                       [&](std::size_t w, std::uint64_t active, const std::uint8_t* next) {
                           words_[w] = {active, static_cast<std::size_t>(next - cases)};
                       });
        const auto size = static_cast<std::size_t>(cases_end - cases);
        widen(cases, size, list_.data());
        const auto cells = at.cells();
        for (const AmbiguousCell& cell : cells)
            list_[index_of(cell)] =
                static_cast<std::uint16_t>(kFirstRunningShape + cell.topology.shape_number);
        const std::uint16_t* from = list_.data();
        if (HWY_UNLIKELY(at->inner_points > 0)) {
            for (const AmbiguousCell& cell : cells) {
                if (HWY_LIKELY(cell.topology.inner_points == 0)) continue;
                const std::uint16_t* const here = list_.data() + index_of(cell);
                out = emit_cells(from, here, ids, table_, out, end);
                std::uint32_t edge_ids[kCellEdges];
                ids.write_edges(cell.topology.shape().crossed, edge_ids);
                out = input_.ambiguous->emit_triangles(at.row(), cell, edge_ids, inner_id, out);
                inner_id += cell.topology.inner_points;
                from = here + 1;
            }
        }
        return emit_cells(from, list_.data() + size, ids, table_, out, end);
    }

  private:
    using D16 = hn::ScalableTag<std::uint16_t>;

    // The same numbers in 16 bits. Whole vectors are read and written.
    static HWY_INLINE void widen(const std::uint8_t* HWY_RESTRICT from, std::size_t size,
                                 std::uint16_t* HWY_RESTRICT to) {
        const D16 d;
        for (std::size_t k = 0; k < size; k += hn::Lanes(d))
            hn::StoreU(hn::PromoteTo(d, hn::LoadU(hn::Rebind<std::uint8_t, D16>(), from + k)), d, to + k);
    }

    // The active cells of a word, and the index of the first in the list.
    struct ListedWord {
        std::uint64_t active;
        std::size_t index;
    };

    std::size_t index_of(const AmbiguousCell& cell) const {
        const ListedWord& word = words_[cell.x / 64];
        return word.index + popcount(word.active & ((std::uint64_t{1} << cell.x % 64) - 1));
    }

    const EmitInput& input_;
    const RunningShape* const table_;
    Buffer<ListedWord> words_;    // of the row
    Buffer<std::uint16_t> list_;  // numbers into the table
};

void emit_triangles_target(const EmitInput& input, std::size_t row_begin, std::size_t row_end,
                           std::uint32_t* out) {
    const InsideBits& bits = input.bits;
    const auto ny = static_cast<std::size_t>(bits.ny);
    const auto points = input.points.leaves();
    const auto triangles = input.triangles.leaves();
    const EmittedCase* cases = emitted_cases(input.to_physical.mirrored);
    const std::uint32_t* end =
        out + 3 * (input.triangles.first_output(row_end) - input.triangles.first_output(row_begin));
    Buffer<std::uint8_t> list(64 * (bits.words_per_row + 1));
    AmbiguousRows ambiguous(input.ambiguous, row_begin);
    AmbiguousRowWriter ambiguous_writer(input);
    const auto ids_of_row = [&](std::size_t r, std::uint64_t first_point) {
        const auto first = static_cast<std::uint32_t>(first_point);
        return RowIds{first, first + input.along_x[r], first + input.along_x[r] + input.along_y[r]};
    };
    // The ids of the first points of the rows (y, z) and (y, z + 1), which advance together.
    std::uint64_t first = input.points.first_output(row_begin);
    std::uint64_t first_next_z = input.points.first_output(row_begin + ny);

    for (GridRow at(bits, row_begin); at.index < row_end; at.advance(bits)) {
        const std::size_t r = at.index;
        const std::uint64_t first_next_y = first + points[r];
        const std::uint64_t first_next_yz = first_next_z + (r + ny < points.size() ? points[r + ny] : 0);
        if (triangles[r] != 0) {
            RunningIds ids(ids_of_row(r, first), ids_of_row(r + 1, first_next_y),
                           ids_of_row(r + ny, first_next_z), ids_of_row(r + ny + 1, first_next_yz));
            const RowBits row(bits, at);
            if (HWY_UNLIKELY(ambiguous.reach(r))) {
                const auto first_inner = static_cast<std::uint32_t>(first_next_y - ambiguous->inner_points);
                out = ambiguous_writer.emit(ambiguous, row, ids, first_inner, list.data(), out, end);
            } else {
                const std::uint8_t* list_end =
                    list_cases(input.active, r, row, list.data(), [](auto...) HWY_ATTR {});
                out = emit_cells(list.data(), list_end, ids, cases, out, end);
            }
        }
        first = first_next_y;
        first_next_z = first_next_yz;
    }
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(emit_triangles_target);

void emit_triangles(const EmitInput& input, std::size_t row_begin, std::size_t row_end, Triangle* triangles) {
    const std::uint64_t first = input.triangles.first_output(row_begin);
    HWY_DYNAMIC_DISPATCH(emit_triangles_target)(input, row_begin, row_end, triangles[first].data());
}

}  // namespace marrow::internal
#endif
