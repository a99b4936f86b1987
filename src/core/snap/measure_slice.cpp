// Finds the nearer end of each point's edge with vectors, and stores the results as bits of the crossed
// edges. The bit code is compiled per SIMD target too: it uses the instructions PDEP and POPCNT.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/snap/measure_slice.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "core/marching_cubes/row_bits-inl.h"
#include "measure_slice.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Moves the lowest bits of `values`, in order, to the positions where `mask` has bits.
HWY_INLINE std::uint64_t deposit(std::uint64_t values, std::uint64_t mask) {
#if HWY_ARCH_X86_64 && HWY_TARGET <= HWY_AVX2
    return _pdep_u64(values, mask);
#else
    std::uint64_t result = 0;
    for (; mask != 0; mask &= mask - 1, values >>= 1) result |= mask & (~mask + 1) & (~(values & 1) + 1);
    return result;
#endif
}

// A bit for each point of a slice, in the order of the points.
struct PointBits {
    explicit PointBits(std::size_t points) : at_second_end(points / 64 + 2), near(points / 64 + 2) {}

    // The bits of 64 points from `point` on.
    static HWY_INLINE std::uint64_t from(const Buffer<std::uint64_t>& bits, std::uint32_t point) {
        return bits[point / 64] >> point % 64 | bits[point / 64 + 1] << 1 << (63 - point % 64);
    }

    Buffer<std::uint64_t> at_second_end, near;
};

// Turns fractions into offsets from the nearer ends.
PointBits find_offsets(float limit, std::uint32_t count, float* fractions) {
    const hn::CappedTag<float, 8> d;  // a mask of 8 lanes is one byte
    const auto lanes = static_cast<std::uint32_t>(hn::Lanes(d));
    PointBits bits(count);
    const auto to_bits = [&](auto mask) HWY_ATTR {
        std::uint8_t bytes[8] = {};
        hn::StoreMaskBits(d, mask, bytes);
        return std::uint64_t{bytes[0]};
    };
    std::uint64_t at_second_end = 0, near = 0;
    for (std::uint32_t k = 0; k < count; k += lanes) {
        const auto fraction = hn::LoadU(d, fractions + k), one = hn::Set(d, 1.0f);
        const auto beyond_middle = hn::Gt(fraction, hn::Set(d, 0.5f));
        const auto offset = hn::Sub(fraction, hn::IfThenElseZero(beyond_middle, one));
        hn::StoreU(offset, d, fractions + k);
        at_second_end |= to_bits(beyond_middle) << k % 64;
        near |= to_bits(hn::Le(hn::Abs(offset), hn::Set(d, limit))) << k % 64;
        if ((k + lanes) % 64 != 0 && k + lanes < count) continue;
        bits.at_second_end[k / 64] = at_second_end;
        bits.near[k / 64] = near;
        at_second_end = near = 0;
    }
    return bits;
}

// Writes the x of the samples of a word that have a bit. Four are written without a branch.
HWY_INLINE void list_x(std::uint64_t bits, std::size_t word, std::uint32_t* x) {
    const auto first = static_cast<std::uint32_t>(64 * word);
    for (const std::uint32_t* const end = x + popcount(bits); x < end; x += 4) {
        for (std::size_t k = 0; k < 4; ++k) {
            x[k] = first + static_cast<std::uint32_t>(std::countr_zero(bits));
            bits &= bits - 1;
        }
    }
}

void measure_slice_target(const EmitInput& input, float limit, std::int64_t z, SnapSlice& slice,
                          std::uint32_t* edge_x) {
    const InsideBits& bits = input.bits;
    const PointBits point_bits = find_offsets(limit, slice.point_count, slice.offsets.data());
    std::uint32_t point = 0;
    for (std::int64_t y = 0; y < bits.ny; ++y) {
        const std::size_t r = bits.row_index(y, z);
        if (input.points.leaves()[r] == 0) continue;
        slice.rows_in_use[static_cast<std::size_t>(y)] = 1;
        EdgeBits* const edges = slice.edges.data() + slice.first_word(y);
        const RowBits row(bits, GridRow(bits, r));
        const auto fill = [&](std::size_t axis, const auto& crossed_in) HWY_ATTR {
            for_each_active_word(input.active, r, [&](std::size_t w) HWY_ATTR {
                const std::uint64_t crossed = crossed_in(w);
                edges[w].crossed[axis] = crossed;
                edges[w].at_second_end[axis] =
                    deposit(point_bits.from(point_bits.at_second_end, point), crossed);
                edges[w].near[axis] = deposit(point_bits.from(point_bits.near, point), crossed);
                edges[w].first_point[axis] = point;
                list_x(crossed, w, edge_x + point);
                point += popcount(crossed);
                // If the next word is not active, its first sample still has an edge in direction -x.
                edges[w + 1].first_point[axis] = point;
            });
        };
        fill(0, [&](std::size_t w) HWY_ATTR { return row.crossed_x(kRow, w); });
        fill(1, [&](std::size_t w) HWY_ATTR { return row.crossed_y(w); });
        fill(2, [&](std::size_t w) HWY_ATTR { return row.crossed_z(w); });
    }
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(measure_slice_target);

void measure_slice(const EmitInput& input, float limit, std::int64_t z, SnapSlice& slice,
                   std::uint32_t* edge_x) {
    HWY_DYNAMIC_DISPATCH(measure_slice_target)(input, limit, z, slice, edge_x);
}

}  // namespace marrow::internal
#endif
