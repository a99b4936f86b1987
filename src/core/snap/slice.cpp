#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/snap/slice.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include <marrow/vector.h>

#include "core/marching_cubes/row_bits-inl.h"
#include "slice.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// The lowest bits of `values`, in order, to where `places` has bits.
HWY_INLINE std::uint64_t deposit(std::uint64_t values, std::uint64_t places) {
#if HWY_ARCH_X86_64 && HWY_TARGET <= HWY_AVX2
    return _pdep_u64(values, places);
#else
    std::uint64_t result = 0;
    for (; places != 0; places &= places - 1, values >>= 1)
        result |= places & (~places + 1) & (~(values & 1) + 1);
    return result;
#endif
}

// What is known of a slice's points, a bit of each in their order.
struct PointBits {
    explicit PointBits(std::size_t points) : second(points / 64 + 2), near(points / 64 + 2) {}

    static HWY_INLINE std::uint64_t from(const Buffer<std::uint64_t>& bits, std::uint32_t point) {
        return bits[point / 64] >> point % 64 | bits[point / 64 + 1] << 1 << (63 - point % 64);
    }

    Buffer<std::uint64_t> second, near;
};

// Turns fractions into offsets from the nearer end.
PointBits find_offsets(float limit, std::uint32_t count, float* fractions) {
    const hn::CappedTag<float, 8> d;  // whose masks are one byte
    const auto lanes = static_cast<std::uint32_t>(hn::Lanes(d));
    PointBits bits(count);
    const auto to_bits = [&](auto mask) HWY_ATTR {
        std::uint8_t some[8] = {};
        hn::StoreMaskBits(d, mask, some);
        return std::uint64_t{some[0]};
    };
    std::uint64_t second = 0, near = 0;
    for (std::uint32_t k = 0; k < count; k += lanes) {
        const auto fraction = hn::LoadU(d, fractions + k), one = hn::Set(d, 1.0f);
        const auto is_second = hn::Gt(fraction, hn::Set(d, 0.5f));
        const auto offset = hn::Sub(fraction, hn::IfThenElseZero(is_second, one));
        hn::StoreU(offset, d, fractions + k);
        second |= to_bits(is_second) << k % 64;
        near |= to_bits(hn::Le(hn::Abs(offset), hn::Set(d, limit))) << k % 64;
        if ((k + lanes) % 64 != 0 && k + lanes < count) continue;
        bits.second[k / 64] = second;
        bits.near[k / 64] = near;
        second = near = 0;
    }
    return bits;
}

void measure_slice_target(const EmitInput& input, float limit, std::int64_t z, SnapSlice& slice) {
    const InsideBits& bits = input.bits;
    const PointBits known = find_offsets(limit, slice.size, slice.offsets.data());
    std::uint32_t point = 0;
    for (std::int64_t y = 0; y < bits.ny; ++y) {
        const std::size_t r = bits.row_index(y, z);
        if (input.points.leaves()[r] == 0) continue;
        slice.in_use[static_cast<std::size_t>(y)] = 1;
        WordEdges* const edges = slice.edges.data() + slice.first_word(y);
        const RowBits row(bits, GridRow(bits, r));
        const auto place = [&](std::size_t a, const auto& crossed) HWY_ATTR {
            for_each_active_word(input.active, r, [&](std::size_t w) HWY_ATTR {
                const std::uint64_t here = crossed(w);
                edges[w].crossed[a] = here;
                edges[w].second[a] = deposit(known.from(known.second, point), here);
                edges[w].near[a] = deposit(known.from(known.near, point), here);
                edges[w].first_point[a] = point;
                point += popcount(here);
                // For the one that ends at the next word's first sample.
                edges[w + 1].first_point[a] = point;
            });
        };
        place(0, [&](std::size_t w) HWY_ATTR { return row.crossed_x(kRow, w); });
        place(1, [&](std::size_t w) HWY_ATTR { return row.crossed_y(w); });
        place(2, [&](std::size_t w) HWY_ATTR { return row.crossed_z(w); });
    }
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(measure_slice_target);

void SnapSlice::clear(const InsideBits& bits, bool normals_wanted) {
    points.resize(size + kSlack);
    offsets.resize(size + kSlack);
    normals.resize(normals_wanted ? size : 0);
    from_before.clear();
    if (edges.empty()) {
        in_use.resize(static_cast<std::size_t>(bits.ny));
        stride = bits.words_per_row + 1;
        edges.resize(first_word(bits.ny));
        sides.resize(edges.size());
        std::fill(edges.begin(), edges.end(), WordEdges{});
        std::fill(sides.begin(), sides.end(), WordSides{});
    }
    for (std::size_t y = 0; y < in_use.size(); ++y) {
        if (in_use[y] == 0) continue;
        const std::size_t first = first_word(static_cast<std::int64_t>(y));
        std::fill_n(edges.data() + first, stride, WordEdges{});
        std::fill_n(sides.data() + first, stride, WordSides{});
        in_use[y] = 0;
    }
}

std::size_t SnapSlice::bytes() const {
    return points.size() * sizeof points[0] + normals.size() * sizeof normals[0] +
           offsets.size() * sizeof offsets[0] + edges.size() * (sizeof edges[0] + sizeof sides[0]);
}

Mat3d inverse_of(const Mat3d& m) {
    Mat3d inverse;
    for (std::size_t a = 0; a < 3; ++a) {
        const std::size_t b = (a + 1) % 3, c = (a + 2) % 3;
        inverse[a] = cross({m[0][b], m[1][b], m[2][b]}, {m[0][c], m[1][c], m[2][c]});
        inverse[a] = 1 / dot(inverse[a], {m[0][a], m[1][a], m[2][a]}) * inverse[a];
    }
    return inverse;
}

void measure_slice(const EmitInput& input, float limit, std::int64_t z, SnapSlice& slice) {
    HWY_DYNAMIC_DISPATCH(measure_slice_target)(input, limit, z, slice);
}

}  // namespace marrow::internal
#endif
