#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "emit_triangles.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <bit>

#include "case_table.h"
#include "emit.h"
#include "row_bits-inl.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Where the point ids of a row of samples start: its edges along x, y and z.
struct RowIds {
    std::uint32_t x, y, z;
};

constexpr std::size_t kWrittenAtOnce = 16;  // ids, of which up to 3 * kMaxTriangles count
static_assert(sizeof(Case::edges) == kWrittenAtOnce);

// The ids of the points on a cell's edges while cells pass by in x.
//
// Every point on the edges around a row of cells belongs to the next active cell, so ids are never looked up:
// eight counters run along, one for each edge of the cell but those at its far x. An edge that is crossed
// uses its counter and advances it; the far edges along y and z are then simply the next values. Edge numbers
// (case_table.h) are chosen so that counters and the bits of `crossed` correspond.
#if HWY_CAP_GE256
class RunningIds {
  public:
    RunningIds(const RowIds& row, const RowIds& next_y, const RowIds& next_z, const RowIds& next_yz) {
        alignas(32) const std::uint32_t first[] = {row.x, next_y.x, next_z.x, next_yz.x,
                                                   row.y, next_z.y, row.z,    next_y.z};
        counters_ = hn::Load(D(), first);
    }

    // Writes kWrittenAtOnce ids, those of the cell's triangles first, and moves on.
    HWY_INLINE void write(const Case& c, std::uint32_t* HWY_RESTRICT out) {
        const D d;
        const auto is_crossed = hn::And(hn::Shr(hn::Set(d, c.crossed), hn::Iota(d, 0)), hn::Set(d, 1));
        const auto advanced = hn::Add(counters_, is_crossed);
        const auto far = hn::ConcatUpperUpper(d, advanced, advanced);
        for (std::size_t k = 0; k < kWrittenAtOnce; k += 8) {
            const auto edges =
                hn::PromoteTo(d, hn::LoadU(hn::FixedTag<std::uint8_t, 8>(), c.edges.data() + k));
            const auto lanes = hn::IndicesFromVec(d, hn::And(edges, hn::Set(d, 7)));
            const auto is_near =
                hn::Lt(hn::BitCast(hn::RebindToSigned<D>(), edges), hn::Set(hn::RebindToSigned<D>(), 8));
            hn::StoreU(hn::IfThenElse(hn::RebindMask(d, is_near), hn::TableLookupLanes(counters_, lanes),
                                      hn::TableLookupLanes(far, lanes)),
                       d, out + k);
        }
        counters_ = advanced;
    }

  private:
    using D = hn::FixedTag<std::uint32_t, 8>;
    hn::Vec<D> counters_;
};
#else
class RunningIds {
  public:
    RunningIds(const RowIds& row, const RowIds& next_y, const RowIds& next_z, const RowIds& next_yz)
        : counters_{row.x, next_y.x, next_z.x, next_yz.x, row.y, next_z.y, row.z, next_y.z} {}

    HWY_INLINE void write(const Case& c, std::uint32_t* HWY_RESTRICT out) {
        std::uint32_t ids[kEdges];
        for (int e = 0; e < 8; ++e) {
            ids[e] = counters_[e];
            counters_[e] += c.crossed >> e & 1;
        }
        for (int e = 8; e < kEdges; ++e) ids[e] = counters_[e - 4];
        for (std::size_t k = 0; k < kWrittenAtOnce; ++k) out[k] = ids[c.edges[k]];
    }

  private:
    std::uint32_t counters_[8];
};
#endif

// Appends the cases of a row's active cells to what `list` points to, and returns its new end.
HWY_INLINE std::uint8_t* list_cases(const ActiveWords& active_words, std::size_t r, const RowBits& row,
                                    std::uint8_t* HWY_RESTRICT list) {
    for_each_active_word(active_words, r, [&](std::size_t w) HWY_ATTR {
        const CellBits cells(row, w);
        std::uint64_t active = cells.active() & row.valid(w);
        const int count = __builtin_popcountll(active);
        alignas(64) std::uint8_t cases[65];
        cells.cell_cases(cases);
        cases[64] = 0;  // for no cell
        // Most words have few. List so many without asking, and overwrite what was too much.
        for (int k = 0; k < count; k += 4) {
            for (int i = k; i < k + 4; ++i) {
                list[i] = cases[std::countr_zero(active)];
                active &= active - 1;
            }
        }
        list += count;
    });
    return list;
}

// Writes the triangles of a row's cells; `end` is the end of the memory that may be written.
HWY_INLINE std::uint32_t* emit_row(const std::uint8_t* first, const std::uint8_t* last, RunningIds ids,
                                   const Case* cases, std::uint32_t* HWY_RESTRICT out,
                                   const std::uint32_t* end) {
    // What is written too much, the next cell overwrites; but behind the last one others write.
    const std::uint8_t* const fast_end =
        end - out >= static_cast<std::ptrdiff_t>(kWrittenAtOnce) * (last - first) ? last : first;
    for (; first < fast_end; ++first) {
        const Case& c = cases[*first];
        ids.write(c, out);
        out += 3 * c.triangles;
    }
    for (; first < last; ++first) {
        const Case& c = cases[*first];
        std::uint32_t triangles[kWrittenAtOnce];
        ids.write(c, triangles);
        out = std::copy_n(triangles, 3 * c.triangles, out);
    }
    return out;
}

void emit_triangles_target(const EmitInput& input, std::size_t row_begin, std::size_t row_end,
                           std::uint32_t* out) {
    const InsideBits& bits = input.bits;
    const auto ny = static_cast<std::size_t>(bits.ny);
    const auto points = input.points.leaves();
    const auto triangles = input.triangles.leaves();
    const Case* cases = input.frame.mirrored ? kMirroredCases.data() : kCases.data();
    const std::uint32_t* end =
        out + 3 * (input.triangles.first_output(row_end) - input.triangles.first_output(row_begin));
    Buffer<std::uint8_t> list(64 * bits.words_per_row + 4);
    const auto ids_of_row = [&](std::size_t r, std::uint64_t first_point) {
        const auto first = static_cast<std::uint32_t>(first_point);
        return RowIds{first, first + input.along_x[r], first + input.along_x[r] + input.along_y[r]};
    };
    // The first points of the rows (y, z) and (y, z + 1), which advance together.
    std::uint64_t first = input.points.first_output(row_begin);
    std::uint64_t first_next_z = input.points.first_output(row_begin + ny);

    for (std::size_t r = row_begin; r < row_end; ++r) {
        const std::uint64_t first_next_y = first + points[r];
        const std::uint64_t first_next_yz = first_next_z + (r + ny < points.size() ? points[r + ny] : 0);
        if (triangles[r] != 0) {
            const RunningIds ids(ids_of_row(r, first), ids_of_row(r + 1, first_next_y),
                                 ids_of_row(r + ny, first_next_z), ids_of_row(r + ny + 1, first_next_yz));
            const std::uint8_t* list_end = list_cases(input.active, r, RowBits(bits, r), list.data());
            out = emit_row(list.data(), list_end, ids, cases, out, end);
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

void emit_triangles(const EmitInput& input, std::size_t row_begin, std::size_t row_end,
                    Triangle* triangles) noexcept {
    const std::uint64_t first = input.triangles.first_output(row_begin);
    HWY_DYNAMIC_DISPATCH(emit_triangles_target)(input, row_begin, row_end, triangles[first].data());
}

}  // namespace marrow::internal
#endif
