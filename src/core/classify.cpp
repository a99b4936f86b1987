#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "classify.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <limits>
#include <type_traits>

#include "classify.h"
#include "dispatch.h"
#include "threshold.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// 64 samples -> 64 bits; floating-point samples that are not finite are outside and counted.
template <class T>
HWY_INLINE std::uint64_t classify_word(const T* HWY_RESTRICT samples, T threshold, std::int64_t& non_finite) {
    const hn::ScalableTag<T> d;
    constexpr std::size_t kLanes = hn::MaxLanes(d);
    const auto lowest_inside = hn::Set(d, threshold);
    std::uint64_t word = 0;
    for (std::size_t i = 0; i < 64; i += kLanes) {
        const auto v = hn::LoadU(d, samples + i);
        auto outside = hn::Lt(v, lowest_inside);
        if constexpr (std::is_floating_point_v<T>) {
            const auto finite = hn::IsFinite(v);
            outside = hn::Or(outside, hn::Not(finite));
            if (HWY_UNLIKELY(!hn::AllTrue(d, finite))) {
                non_finite += static_cast<std::int64_t>(kLanes - hn::CountTrue(d, finite));
            }
        }
        std::uint64_t bits = 0;
        hn::StoreMaskBits(d, outside, reinterpret_cast<std::uint8_t*>(&bits));
        word |= bits << i;
    }
    return ~word;
}

// The last, partial word of a row.
template <class T>
HWY_INLINE std::uint64_t classify_tail(const T* samples, int count, T threshold, std::int64_t& non_finite) {
    std::uint64_t word = 0;
    for (int i = 0; i < count; ++i) {
        const T v = samples[i];
        word |= std::uint64_t{is_inside(v, threshold)} << i;
        if constexpr (std::is_floating_point_v<T>) {
            non_finite += !(v - v == 0);
        }
    }
    return word;
}

// A row of samples -> its words. With padding, every bit moves up by one and the first is outside.
template <class T>
void classify_row(const T* samples, std::int64_t count, T threshold, int pad, std::uint64_t* words,
                  std::size_t word_count, std::int64_t& non_finite) {
    std::size_t w = 0;
    std::uint64_t carry = 0;
    const auto put = [&](std::uint64_t word) HWY_ATTR {
        words[w++] = word << pad | carry;
        carry = pad != 0 ? word >> 63 : 0;
    };
    std::int64_t x = 0;
    for (; x + 64 <= count; x += 64) put(classify_word(samples + x, threshold, non_finite));
    if (x < count) put(classify_tail(samples + x, static_cast<int>(count - x), threshold, non_finite));
    if (w < word_count) words[w] = carry;
}

template <class T>
std::int64_t classify(const VolumeView& volume, double isovalue, std::int64_t z_begin, std::int64_t z_end,
                      InsideBits& bits) {
    const auto [nx, ny, nz] = volume.geometry.dims;
    const auto threshold = inside_threshold<T>(isovalue);
    std::int64_t non_finite = 0;
    for (std::int64_t z = z_begin; z < z_end; ++z) {
        for (std::int64_t y = 0; y < bits.dims[1]; ++y) {
            std::uint64_t* row = bits.row(bits.row_index(y, z));
            const std::int64_t volume_y = y - bits.pad, volume_z = z - bits.pad;
            const bool in_volume = volume_y >= 0 && volume_y < ny && volume_z >= 0 && volume_z < nz;
            if (!in_volume || !threshold) {
                std::fill_n(row, bits.words_per_row, std::uint64_t{0});
                continue;
            }
            const T* samples = static_cast<const T*>(volume.data) + (volume_z * ny + volume_y) * nx;
            classify_row(samples, nx, *threshold, bits.pad, row, bits.words_per_row, non_finite);
        }
    }
    return non_finite;
}

std::int64_t classify_any(const VolumeView& volume, double isovalue, std::int64_t z_begin, std::int64_t z_end,
                          InsideBits& bits) {
    return with_sample_type(volume.type, [&](auto sample) {
        return classify<decltype(sample)>(volume, isovalue, z_begin, z_end, bits);
    });
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(classify_any);

std::int64_t classify_slices(const VolumeView& volume, double isovalue, std::int64_t z_begin,
                             std::int64_t z_end, InsideBits& bits) noexcept {
    return HWY_DYNAMIC_DISPATCH(classify_any)(volume, isovalue, z_begin, z_end, bits);
}

InsideBits::InsideBits(const std::array<std::int64_t, 3>& volume_dims, bool closed)
    : dims(volume_dims), pad(closed ? 1 : 0) {
    for (std::int64_t& n : dims) n += 2 * pad;
    words_per_row = static_cast<std::size_t>((dims[0] + 63) / 64);
    words.resize(words_per_row * rows() + 1);
    words.back() = 0;
}

}  // namespace marrow::internal
#endif
