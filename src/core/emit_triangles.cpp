#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "emit_triangles.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "case_table.h"
#include "emit.h"
#include "row_bits-inl.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

// Where the point ids of a row of samples start: its edges along x, y and z.
struct RowIds {
    std::uint32_t x, y, z;
};

RowIds row_ids(const InsideBits& bits, std::size_t r, std::uint64_t first_point) {
    const RowBits row(bits, r);
    std::uint64_t along_x = 0, along_y = 0;
    for (std::size_t w = 0; w < row.words; ++w) {
        along_x += static_cast<std::uint64_t>(__builtin_popcountll(row.crossed_x(kRow, w)));
        along_y += static_cast<std::uint64_t>(__builtin_popcountll(row.crossed_y(w)));
    }
    const auto first = static_cast<std::uint32_t>(first_point);
    return {first, static_cast<std::uint32_t>(first + along_x),
            static_cast<std::uint32_t>(first + along_x + along_y)};
}

// The ids of the points on a cell's edges while cells pass by in x.
//
// Every point on the edges around a row of cells belongs to the next active cell, so ids are never looked up:
// eight counters run along, one for each edge of the cell but those at its far x. An edge that is crossed
// uses its counter and advances it; the far edges along y and z are then simply the next values. Edge numbers
// (case_table.h) are chosen so that lanes and the bits of `crossed` correspond.
class RunningIds {
  public:
    RunningIds(const RowIds& row, const RowIds& next_y, const RowIds& next_z, const RowIds& next_yz)
        : counters_{row.x, next_y.x, next_z.x, next_yz.x, row.y, next_z.y, row.z, next_y.z} {}

    // Writes the ids of the cell's twelve edges (meaningless where not crossed) and moves on.
    HWY_INLINE void next(std::uint32_t crossed, std::uint32_t* HWY_RESTRICT ids) {
        for (unsigned edge = 0; edge < 8; ++edge) {
            ids[edge] = counters_[edge];
            counters_[edge] += crossed >> edge & 1;
        }
        for (unsigned edge = 8; edge < 12; ++edge) ids[edge] = counters_[edge - 4];
    }

  private:
    alignas(32) std::uint32_t counters_[8];
};

HWY_INLINE std::uint32_t* emit_row(const RowBits& row, RunningIds ids, bool mirrored, std::uint32_t* out) {
    alignas(16) std::uint32_t edge_ids[kEdges];
    for (std::size_t w = 0; w < row.words; ++w) {
        const CellBits cells(row, w);
        for (std::uint64_t active = cells.active; active != 0; active &= active - 1) {
            const Case& c = kCases[cells.cell_case(__builtin_ctzll(active))];
            ids.next(c.crossed, edge_ids);
            for (int t = 0; t < 3 * c.triangles; t += 3) {
                out[t] = edge_ids[c.edges[t]];
                out[t + 1] = edge_ids[c.edges[t + 1 + mirrored]];
                out[t + 2] = edge_ids[c.edges[t + 2 - mirrored]];
            }
            out += 3 * c.triangles;
        }
    }
    return out;
}

void emit_triangles_target(const EmitInput& input, std::size_t row_begin, std::size_t row_end,
                           Triangle* triangles) {
    const InsideBits& bits = input.bits;
    const auto ny = static_cast<std::size_t>(bits.dims[1]);
    const auto point_counts = input.points.leaves();
    const auto triangle_counts = input.triangles.leaves();
    // The first points of the rows (y, z) and (y, z + 1), which advance together.
    std::uint64_t first = input.points.first_output(row_begin);
    std::uint64_t first_next_z = input.points.first_output(row_begin + ny);
    std::uint32_t* out = triangles->data();

    for (std::size_t r = row_begin; r < row_end; ++r) {
        if (triangle_counts[r] != 0) {
            const RunningIds ids(row_ids(bits, r, first), row_ids(bits, r + 1, first + point_counts[r]),
                                 row_ids(bits, r + ny, first_next_z),
                                 row_ids(bits, r + ny + 1, first_next_z + point_counts[r + ny]));
            out = emit_row(RowBits(bits, r), ids, input.frame.mirrored, out);
        }
        first += point_counts[r];
        if (r + ny < point_counts.size()) first_next_z += point_counts[r + ny];
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
    HWY_DYNAMIC_DISPATCH(emit_triangles_target)(input, row_begin, row_end, triangles + first);
}

}  // namespace marrow::internal
#endif
