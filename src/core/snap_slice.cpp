#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "snap_slice.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include <marrow/vector.h>

#include "row_bits-inl.h"
#include "snap_slice.h"

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

// Measures the points of a row, whatever their axes: as a point is on an edge, the sum of its three
// coordinates in samples is that of the edge's start and the way along it. What is said of each is a bit in
// their order, which then goes to the edge's place in its word.
class RowMeter {
  public:
    RowMeter(const EmitInput& input, float limit)
        : input_(input),
          limit_(limit),
          x_(3 * 64 * input.bits.words_per_row + 2 * kLanes),
          second_(3 * input.bits.words_per_row + 1),
          near_(3 * input.bits.words_per_row + 1) {
        const Mat3d inverse = inverse_of(input.frame.exact);
        for (std::size_t r = 0; r < 3; ++r)
            per_mm_[r] = static_cast<float>(inverse[0][r] + inverse[1][r] + inverse[2][r]);
    }

    // `first`: the row's first point in the slice.
    HWY_INLINE void measure(const RowBits& row, std::size_t r, const Vec3f& base, std::uint32_t first,
                            SnapSlice& slice, WordEdges* edges) {
        const std::uint32_t count = input_.points.leaves()[r];
        std::uint32_t next = 0;
        const auto list = [&](std::size_t a, const auto& crossed) HWY_ATTR {
            for_each_active_word(input_.active, r, [&](std::size_t w) HWY_ATTR {
                std::uint64_t left = crossed(w);
                edges[w].crossed[a] = left;
                edges[w].first_point[a] = first + next;
                const auto x =
                    static_cast<std::int32_t>(64 * static_cast<std::int64_t>(w) - input_.bits.first_x);
                const std::uint32_t end = next + popcount(left);
                // Most words have few. List so many without asking, and overwrite what was too much.
                do {
                    for (std::uint32_t k = 0; k < kLanes; ++k) {
                        x_[next + k] = x + std::countr_zero(left);
                        left &= left - 1;
                    }
                    next += kLanes;
                } while (HWY_UNLIKELY(next < end));
                next = end;
                // For the one that ends at the next word's first sample.
                edges[w + 1].first_point[a] = first + next;
            });
        };
        list(0, [&](std::size_t w) HWY_ATTR { return row.crossed_x(kRow, w); });
        list(1, [&](std::size_t w) HWY_ATTR { return row.crossed_y(w); });
        list(2, [&](std::size_t w) HWY_ATTR { return row.crossed_z(w); });
        find_offsets(base, slice.points.data() + first, count, slice.offsets.data() + first);
        for_each_active_word(input_.active, r, [&](std::size_t w) HWY_ATTR {
            for (std::size_t a = 0; a < 3; ++a) {
                const std::uint64_t crossed = edges[w].crossed[a];
                const std::uint32_t from = edges[w].first_point[a] - first;
                edges[w].second[a] = deposit(bits_from(second_.data(), from), crossed);
                edges[w].near[a] = deposit(bits_from(near_.data(), from), crossed);
            }
        });
    }

  private:
    static constexpr std::size_t kLanes = 8;  // at most

    static HWY_INLINE std::uint64_t bits_from(const std::uint64_t* bits, std::uint32_t from) {
        return bits[from / 64] >> from % 64 | bits[from / 64 + 1] << 1 << (63 - from % 64);
    }

    HWY_INLINE void find_offsets(const Vec3f& base, const Vec3f* points, std::uint32_t count,
                                 float* offsets) {
        const hn::CappedTag<float, kLanes> d;
        const hn::RebindToSigned<decltype(d)> di;
        using V = hn::Vec<decltype(d)>;
        const V one = hn::Set(d, 1.0f), half = hn::Set(d, 0.5f), limit = hn::Set(d, limit_);
        const auto lanes = static_cast<std::uint32_t>(hn::Lanes(d));
        std::uint64_t second = 0, near = 0;
        for (std::uint32_t k = 0; k < count; k += lanes) {
            V at[3];
            hn::LoadInterleaved3(d, points[k].data(), at[0], at[1], at[2]);
            for (std::size_t r = 0; r < 3; ++r)
                at[r] = hn::Mul(hn::Sub(at[r], hn::Set(d, base[r])), hn::Set(d, per_mm_[r]));
            const V x = hn::ConvertTo(d, hn::LoadU(di, x_.data() + k));
            V fraction = hn::Sub(hn::Add(hn::Add(at[0], at[1]), at[2]), x);
            fraction = hn::Min(hn::Max(fraction, hn::Zero(d)), one);
            const auto is_second = hn::Gt(fraction, half);
            const V offset = hn::Sub(fraction, hn::IfThenElseZero(is_second, one));
            hn::StoreU(offset, d, offsets + k);
            second |= bits_of(d, is_second) << k % 64;
            near |= bits_of(d, hn::Le(hn::Abs(offset), limit)) << k % 64;
            if ((k + lanes) % 64 != 0 && k + lanes < count) continue;
            second_[k / 64] = second;
            near_[k / 64] = near;
            second = near = 0;
        }
    }

    template <class D, class M>
    static HWY_INLINE std::uint64_t bits_of(D d, M mask) {
        std::uint8_t bits[8] = {};
        hn::StoreMaskBits(d, mask, bits);
        return bits[0];
    }

    const EmitInput& input_;
    const float limit_;
    Vec3f per_mm_;  // what the sum of the coordinates gains with a step in mm
    Buffer<std::int32_t> x_;
    Buffer<std::uint64_t> second_, near_;  // bits
};

void measure_slice_target(const EmitInput& input, float limit, std::int64_t z, SnapSlice& slice) {
    const InsideBits& bits = input.bits;
    RowMeter meter(input, limit);
    std::uint32_t point = 0;
    for (std::int64_t y = 0; y < bits.ny; ++y) {
        const std::size_t r = bits.row_index(y, z);
        const Vec3f base = input.frame.row_base(y - bits.pad, z - bits.pad);
        slice.row_bases[static_cast<std::size_t>(y)] = base;
        const std::uint32_t count = input.points.leaves()[r];
        if (count == 0) continue;
        slice.in_use[static_cast<std::size_t>(y)] = 1;
        meter.measure(RowBits(bits, GridRow(bits, r)), r, base, point, slice,
                      slice.edges.data() + slice.first_word(y));
        point += count;
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
        row_bases.resize(static_cast<std::size_t>(bits.ny));
        in_use.resize(row_bases.size());
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
