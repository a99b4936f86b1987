#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "emit_triangles.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <cstring>

#include "case_table.h"
#include "emit.h"
#include "row_bits-inl.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

// Where the point ids of a row of samples start: its edges along x, y and z.
struct RowIds {
    std::uint32_t x, y, z;
};

// The ids of the points on a cell's edges while cells pass by in x.
//
// Every point on the edges around a row of cells belongs to the next active cell, so ids are never looked up:
// eight counters run along, one for each edge of the cell but those at its far x. An edge that is crossed
// uses its counter and advances it; the far edges along y and z are then simply the next values. Edge numbers
// (case_table.h) are chosen so that counters and the bits of `crossed` correspond.
class RunningIds {
  public:
    RunningIds(const RowIds& row, const RowIds& next_y, const RowIds& next_z, const RowIds& next_yz)
        : counters_{row.x, next_y.x, next_z.x, next_yz.x, row.y, next_z.y, row.z, next_y.z} {}

    // Writes the ids of the cell's twelve edges (meaningless where not crossed) and moves on.
    HWY_INLINE void next(std::uint32_t crossed, std::uint32_t* HWY_RESTRICT ids) {
        constexpr Counters kEdge = {0, 1, 2, 3, 4, 5, 6, 7};
        const Counters advanced = counters_ + (((Counters{} + crossed) >> kEdge) & 1);
        std::memcpy(ids + 4, &advanced, sizeof advanced);  // of which the upper half, the far edges, stays
        std::memcpy(ids, &counters_, sizeof counters_);
        counters_ = advanced;
    }

  private:
    typedef std::uint32_t Counters __attribute__((vector_size(32)));
    Counters counters_;
};

// Writes the triangles of a row of cells; `end` is the end of the memory that may be written.
std::uint32_t* emit_row(const RowBits& row, RunningIds ids, const Case* cases,
                        std::uint32_t* HWY_RESTRICT out, const std::uint32_t* end) {
    alignas(32) std::uint32_t edge_ids[kEdges];
    for_each_active_word(row, [&](std::size_t w, std::uint64_t active) HWY_ATTR {
        const CellBits cells(row, w);
        for (; active != 0; active &= active - 1) {
            const Case& c = cases[cells.cell_case(__builtin_ctzll(active))];
            ids.next(c.crossed, edge_ids);
            if (HWY_LIKELY(end - out >= 3 * kMaxTriangles)) {
                // Two triangles are the most frequent case: write them without asking, and overwrite what was
                // too much.
                for (int k = 0; k < 6; ++k) out[k] = edge_ids[c.edges[k]];
                if (c.triangles > 2) {
                    for (int k = 6; k < 3 * kMaxTriangles; ++k) out[k] = edge_ids[c.edges[k]];
                }
            } else {
                for (int k = 0; k < 3 * c.triangles; ++k) out[k] = edge_ids[c.edges[k]];
            }
            out += 3 * c.triangles;
        }
    });
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
            out = emit_row(RowBits(bits, r), ids, cases, out, end);
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
