// Writes the triangles of active cells, with the ids of their points counted instead of looked up.
#define HWY_WANT_AVX3_DL 1  // which lists cases without branches
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/marching_cubes/emit_triangles.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <bit>

#include "case_table.h"
#include "emit.h"
#include "row_bits-inl.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

// The ids of the first points on the edges along x, y and z of a row of samples.
struct RowIds {
    std::uint32_t x, y, z;
};

constexpr std::size_t kIds = 16;  // that are written for each cell: whole vectors

// The ids of the points on the edges of a cell, while a row of cells passes by.
//
// Every point on the edges around a row of cells belongs to the next active cell, so ids are never looked up.
// Eight counters advance with the cells, one for each of the cell's edges except those at its far x. A
// crossed edge uses its counter and advances it. The crossed edges along y and z at the far x have the
// counters' next values. The edges are numbered (see case_table.h) so that edge e < 8 has counter e.
class RunningIds {
  public:
    RunningIds(const RowIds& row, const RowIds& next_y, const RowIds& next_z, const RowIds& next_yz)
        : counters_{row.x, next_y.x, next_z.x, next_yz.x, row.y, next_z.y, row.z, next_y.z} {
        if constexpr (kCounters == 16)
            for (std::size_t e = 0; e < 8; ++e) counters_[8 + e] = counters_[e] + 1;
    }

    // Writes kIds ids, of which the first are those of the cell's triangles, and moves on to the next active
    // cell.
    HWY_INLINE void write(const RunningCase& c, std::uint32_t* HWY_RESTRICT out) {
        write_ids<3 * kMaxTriangles>(c.ids, out);
        advance(c.advance);
    }
    // The same for a shape, and RunningShape::kIds ids.
    HWY_INLINE void write(const RunningShape& s, std::uint32_t* HWY_RESTRICT out) {
        write_ids<kIds>(s.ids, out);
        write_ids<kIds>(s.ids + kIds, out + kIds);
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

#if HWY_TARGET == HWY_AVX3_DL

// The samples around the 64 cells of a word: bit i of here_[r] is the sample at x = i in row r of RowBits, and of next_[r]
// the sample at x = i + 1.
class CellRows {
  public:
    CellRows(const RowBits& row, std::size_t w) {
        for (std::size_t r = 0; r < 4; ++r) {
            here_[r] = row.rows[r][w];
            next_[r] = row.next_x(static_cast<Row>(r), w);
        }
    }

    // The cells that the surface crosses: their corners are neither all outside nor all inside.
    HWY_INLINE std::uint64_t active() const {
        const std::uint64_t some =
            here_[0] | here_[1] | here_[2] | here_[3] | next_[0] | next_[1] | next_[2] | next_[3];
        const std::uint64_t all =
            here_[0] & here_[1] & here_[2] & here_[3] & next_[0] & next_[1] & next_[2] & next_[3];
        return some & ~all;
    }

    // Writes the indices into kRunningCases of those of the cells that `active` selects. Returns their end; 64 bytes
    // more may be overwritten.
    HWY_INLINE std::uint8_t* list(std::uint64_t active, std::uint8_t* HWY_RESTRICT out) const {
        auto cases = hn::Zero(D());
        for (std::size_t r = 0; r < 4; ++r) {
            cases = hn::Or(cases, hn::IfThenElseZero(cells(here_[r]), hn::Set(D(), 1 << r)));
            cases = hn::Or(cases, hn::IfThenElseZero(cells(next_[r]), hn::Set(D(), 16 << r)));
        }
        hn::StoreU(hn::Compress(cases, cells(active)), D(), out);
        return out + popcount(active);
    }

  private:
    using D = hn::FixedTag<std::uint8_t, 64>;

    static HWY_INLINE hn::Mask<D> cells(const std::uint64_t& bits) {
        return hn::LoadMaskBits(D(), reinterpret_cast<const std::uint8_t*>(&bits));
    }

    std::uint64_t here_[4], next_[4];
};

#else

// The samples around the 64 cells of a word. Lane r belongs to row r of RowBits: bit i of that lane of here_
// is the sample at x = i, and of next_ the sample at x = i + 1. Narrow targets have two rows in each of two
// vectors, or one in each of four.
class CellRows {
  public:
    CellRows(const RowBits& row, std::size_t w) {
        const bool last = w + 1 == row.words;
        for (std::size_t k = 0; k < kVectors; ++k) {
            here_[k] = samples(row, k, w);
            const Vec ahead = last ? hn::Zero(D()) : samples(row, k, w + 1);
            next_[k] = hn::Or(hn::ShiftRight<1>(here_[k]), hn::ShiftLeft<63>(ahead));
        }
    }

    // The cells that the surface crosses: their corners are neither all outside nor all inside.
    HWY_INLINE std::uint64_t active() const {
        Vec some = hn::Or(here_[0], next_[0]), all = hn::And(here_[0], next_[0]);
        for (std::size_t k = 1; k < kVectors; ++k) {
            some = hn::Or(some, hn::Or(here_[k], next_[k]));
            all = hn::And(all, hn::And(here_[k], next_[k]));
        }
        if constexpr (kLanes >= 2) {
            some = hn::Or(some, hn::Reverse2(D(), some));
            all = hn::And(all, hn::Reverse2(D(), all));
        }
#if HWY_CAP_GE256
        some = hn::Or(some, hn::SwapAdjacentBlocks(some));
        all = hn::And(all, hn::SwapAdjacentBlocks(all));
#endif
        return hn::GetLane(hn::AndNot(all, some));
    }
    // Writes the indices into kRunningCases of those of the cells that `active` selects. Returns their end; four bytes
    // more may be overwritten.
    HWY_INLINE std::uint8_t* list(std::uint64_t active, std::uint8_t* HWY_RESTRICT out) const {
        return list_bits(active, out, [&](std::uint64_t left, std::uint8_t& cell_case) HWY_ATTR {
            cell_case = running_case(left & (~left + 1));
        });
    }

  private:
    using D = hn::CappedTag<std::uint64_t, 4>;
    using Vec = hn::Vec<D>;
    static constexpr std::size_t kLanes = hn::MaxLanes(D()), kVectors = 4 / kLanes;

    // The index into kRunningCases of the cell whose bit is set in `bit`.
    HWY_INLINE std::uint8_t running_case(std::uint64_t bit) const {
        const Vec cell = hn::Set(D(), bit);
        unsigned c = 0;
        for (std::size_t k = 0; k < kVectors; ++k) {
            std::uint8_t here = 0, next = 0;
            hn::StoreMaskBits(D(), hn::TestBit(here_[k], cell), &here);
            hn::StoreMaskBits(D(), hn::TestBit(next_[k], cell), &next);
            c |= static_cast<unsigned>(here | next << 4) << kLanes * k;
        }
        return static_cast<std::uint8_t>(c);
    }

    // Word w of each row of vector k.
    static HWY_INLINE Vec samples(const RowBits& row, std::size_t k, std::size_t w) {
        const D d;
        const auto of_row = [&](std::size_t r) HWY_ATTR { return hn::Set(d, row.rows[kLanes * k + r][w]); };
#if HWY_CAP_GE256
        return hn::ConcatUpperLower(d, hn::OddEven(of_row(3), of_row(2)), hn::OddEven(of_row(1), of_row(0)));
#else
        if constexpr (kLanes == 2) return hn::OddEven(of_row(1), of_row(0));
        return of_row(0);
#endif
    }

    Vec here_[kVectors], next_[kVectors];
};

#endif

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

// Writes the triangles of cells that follow each other in a row. `end` is the end of the memory that may be
// written.
HWY_INLINE std::uint32_t* emit_cells(const std::uint8_t* first, const std::uint8_t* last,
                                     RunningIds& running_ids, const RunningCase* cases,
                                     std::uint32_t* HWY_RESTRICT out, const std::uint32_t* end) {
    RunningIds ids = running_ids;
    // Each cell writes kIds ids, and the next cell overwrites those beyond its triangles. Near the end of the
    // share this is not allowed, because another thread writes there.
    const std::uint8_t* const fast_end =
        end - out >= static_cast<std::ptrdiff_t>(kIds) * (last - first) ? last : first;
    for (; first < fast_end; ++first) {
        const RunningCase& c = cases[*first];
        ids.write(c, out);
        out += 3 * c.triangles;
    }
    for (; first < last; ++first) {
        const RunningCase& c = cases[*first];
        std::uint32_t triangles[kIds];
        ids.write(c, triangles);
        out = std::copy_n(triangles, 3 * c.triangles, out);
    }
    running_ids = ids;
    return out;
}

// Writes the triangles of rows that have ambiguous cells. These interrupt the list of cases.
class AmbiguousRows {
  public:
    explicit AmbiguousRows(const EmitInput& input)
        : input_(input),
          shapes_(input.to_physical.mirrored ? kMirroredRunningShapes.data() : kRunningShapes.data()) {}

    // Whether a row has ambiguous cells, and so emit() is for it.
    bool has_any(std::size_t row) const {
        return input_.ambiguous != nullptr && input_.ambiguous->has_any(row);
    }

    // `inner_id` is the id of the row's first inner point, and `list` has room for the row's cases.
    std::uint32_t* emit(std::size_t r, const RowBits& row, RunningIds& ids, std::uint32_t inner_id,
                        const RunningCase* cases, std::uint8_t* list, std::uint32_t* out,
                        const std::uint32_t* end) {
        const auto cells = input_.ambiguous->of_row(r, memory_);
        // Their indices in the list of cases.
        indices_.clear();
        const std::uint8_t* const list_end = list_cases(
            input_.active, r, row, list, [&](std::size_t w, std::uint64_t active, const std::uint8_t* next) {
                for (std::size_t k = indices_.size(); k < cells.size() && cells[k].x / 64 == w; ++k) {
                    const std::uint64_t before = active & ((std::uint64_t{1} << cells[k].x % 64) - 1);
                    indices_.push_back(next - list + popcount(before));
                }
            });
        const std::uint8_t* from = list;
        for (std::size_t k = 0; k < cells.size(); ++k) {
            out = emit_cells(from, list + indices_[k], ids, cases, out, end);
            out = emit_cell(r, cells[k], ids, inner_id, out, end);
            from = list + indices_[k] + 1;
        }
        return emit_cells(from, list_end, ids, cases, out, end);
    }

  private:
    HWY_INLINE std::uint32_t* emit_cell(std::size_t r, const AmbiguousCell& cell, RunningIds& ids,
                                        std::uint32_t& inner_id, std::uint32_t* HWY_RESTRICT out,
                                        const std::uint32_t* end) const {
        if (HWY_UNLIKELY(cell.has_inner_points)) {
            std::uint32_t edge_ids[kCellEdges];
            ids.write_edges(kShapes[cell.shape].crossed, edge_ids);
            return input_.ambiguous->emit_triangles(r, cell, edge_ids, inner_id, out);
        }
        const RunningShape& shape = shapes_[cell.shape];
        if (HWY_LIKELY(end - out >= static_cast<std::ptrdiff_t>(RunningShape::kIds))) {
            ids.write(shape, out);
            return out + 3 * shape.triangles;
        }
        std::uint32_t triangles[RunningShape::kIds];
        ids.write(shape, triangles);
        return std::copy_n(triangles, 3 * shape.triangles, out);
    }

    const EmitInput& input_;
    const RunningShape* const shapes_;
    std::vector<AmbiguousCell> memory_;
    std::vector<std::ptrdiff_t> indices_;
};

void emit_triangles_target(const EmitInput& input, std::size_t row_begin, std::size_t row_end,
                           std::uint32_t* out) {
    const InsideBits& bits = input.bits;
    const auto ny = static_cast<std::size_t>(bits.ny);
    const auto points = input.points.leaves();
    const auto triangles = input.triangles.leaves();
    const RunningCase* cases =
        input.to_physical.mirrored ? kMirroredRunningCases.data() : kRunningCases.data();
    const std::uint32_t* end =
        out + 3 * (input.triangles.first_output(row_end) - input.triangles.first_output(row_begin));
    Buffer<std::uint8_t> list(64 * (bits.words_per_row + 1));
    AmbiguousRows ambiguous(input);
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
            if (HWY_UNLIKELY(ambiguous.has_any(r))) {
                const auto first_inner = static_cast<std::uint32_t>(first_next_y - input.inner[r]);
                out = ambiguous.emit(r, row, ids, first_inner, cases, list.data(), out, end);
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
