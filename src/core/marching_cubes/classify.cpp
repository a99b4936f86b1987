// Compares 64 samples at a time with the isovalue, with vectors.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/marching_cubes/classify.cpp"
#include <hwy/cache_control.h>
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include "classify.h"
#include "core/grid/threshold.h"
#include "core/volume/rows.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// The bits of a mask.
template <class T>
HWY_INLINE std::uint64_t bits_of(const hn::Mask<hn::ScalableTag<T>>& mask) {
    const hn::ScalableTag<T> d;
#if HWY_TARGET == HWY_WASM
    // Highway multiplies, although there are instructions for it.
    const v128_t lanes = hn::VecFromMask(d, mask).raw;
    if constexpr (sizeof(T) == 1) return wasm_i8x16_bitmask(lanes);
    if constexpr (sizeof(T) == 2) return wasm_i16x8_bitmask(lanes);
    if constexpr (sizeof(T) == 4) return wasm_i32x4_bitmask(lanes);
    return wasm_i64x2_bitmask(lanes);
#else
    std::uint64_t bits = 0;
    hn::StoreMaskBits(d, mask, reinterpret_cast<std::uint8_t*>(&bits));
    return bits;
#endif
}

// Classifies 64 samples.
template <class T>
HWY_INLINE std::uint64_t classify_word(const T* HWY_RESTRICT samples, T threshold, std::int64_t& non_finite) {
    const hn::ScalableTag<T> d;
    constexpr std::size_t kLanes = hn::MaxLanes(d);
    const auto lowest_inside = hn::Set(d, threshold);
    std::uint64_t outside = 0;
#if HWY_TARGET == HWY_WASM
    if constexpr (sizeof(T) == 2) {
        // The masks of two vectors become one vector of bytes.
        const auto below = [&](std::size_t i) HWY_ATTR {
            return hn::VecFromMask(d, hn::Lt(hn::LoadU(d, samples + i), lowest_inside)).raw;
        };
        for (std::size_t i = 0; i < 64; i += 2 * kLanes) {
            const v128_t both = wasm_i8x16_narrow_i16x8(below(i), below(i + kLanes));
            outside |= std::uint64_t{wasm_i8x16_bitmask(both)} << i;
        }
        return ~outside;
    }
#endif
    for (std::size_t i = 0; i < 64; i += kLanes) {
        const auto v = hn::LoadU(d, samples + i);
        auto below = hn::Lt(v, lowest_inside);
        if constexpr (std::is_floating_point_v<T>) {
            const auto finite = hn::IsFinite(v);
            below = hn::Or(below, hn::Not(finite));
            if (HWY_UNLIKELY(!hn::AllTrue(d, finite))) {
                non_finite += static_cast<std::int64_t>(kLanes - hn::CountTrue(d, finite));
            }
        }
        outside |= bits_of<T>(below) << i;
    }
    return ~outside;
}

// Classifies up to 64 samples. The bits after them are 0.
template <class T>
HWY_INLINE std::uint64_t classify_samples(const T* samples, std::int64_t count, T threshold,
                                          std::int64_t& non_finite) {
    if (HWY_LIKELY(count >= 64)) return classify_word(samples, threshold, non_finite);
    std::uint64_t word = 0;
    for (std::int64_t i = 0; i < count; ++i) {
        word |= std::uint64_t{is_inside(samples[i], threshold)} << i;
        if constexpr (std::is_floating_point_v<T>) non_finite += !std::isfinite(samples[i]);
    }
    return word;
}

// The range of up to 64 samples in each of `rows` rows.
template <class T>
BlockRange range_of_block(const T* samples, std::int64_t count, std::int64_t rows, std::int64_t stride) {
    const hn::ScalableTag<T> d;
    constexpr std::size_t kLanes = hn::MaxLanes(d);
    HWY_ALIGN T lows[kLanes];
    HWY_ALIGN T highs[kLanes];
    bool all_finite = true;
    auto low = hn::Set(d, std::numeric_limits<T>::max()), high = hn::Set(d, std::numeric_limits<T>::lowest());
    const auto extend = [&](auto v) HWY_ATTR {
        if constexpr (std::is_floating_point_v<T>) {
            const auto finite = hn::IsFinite(v);
            all_finite &= hn::AllTrue(d, finite);
            low = hn::Min(low, hn::IfThenElse(finite, v, low));
            high = hn::Max(high, hn::IfThenElse(finite, v, high));
        } else {
            low = hn::Min(low, v);
            high = hn::Max(high, v);
        }
    };
    const auto lanes = static_cast<std::int64_t>(kLanes);
    for (std::int64_t row = 0; row < rows; ++row, samples += stride) {
        std::int64_t i = 0;
        for (; i + lanes <= count; i += lanes) extend(hn::LoadU(d, samples + i));
        for (; i < count; ++i) extend(hn::Set(d, samples[i]));
    }
    hn::Store(low, d, lows);
    hn::Store(high, d, highs);
    const T min = *std::min_element(lows, lows + kLanes), max = *std::max_element(highs, highs + kLanes);

    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    BlockRange range{static_cast<float>(min), static_cast<float>(max)};
    if (static_cast<double>(range.min) > static_cast<double>(min))
        range.min = std::nextafter(range.min, -kInfinity);
    if (static_cast<double>(range.max) < static_cast<double>(max))
        range.max = std::nextafter(range.max, kInfinity);
    if (!all_finite) range.min = -kInfinity;
    return range;
}

// A slice of the volume, and the grid whose bits it makes.
template <class T>
struct Slice {
    const T* samples;
    std::int64_t nx, ny, pitch, z;
    InsideBits& bits;

    Slice(const VolumeView& volume, std::int64_t slice, InsideBits& inside_bits)
        : samples(row_of<T>(volume, 0, slice)),
          nx(volume.geometry.dims[0]),
          ny(volume.geometry.dims[1]),
          pitch(volume.row_pitch()),
          z(slice),
          bits(inside_bits) {}

    const T* row(std::int64_t y) const { return samples + y * pitch; }
    // The words that hold the bits of a row's samples.
    std::uint64_t* words(std::int64_t y) const {
        return bits.row(bits.row_index(y + bits.first_y, z + bits.first_z)) + bits.first_x / 64;
    }
    std::int64_t word_count() const { return (nx + 63) / 64; }
};

// Prefetches 64 samples.
template <class T>
HWY_INLINE void prefetch(const T* samples) {
    for (std::size_t i = 0; i < 64; i += 64 / sizeof(T)) hwy::Prefetch(samples + i);
}

template <class T>
std::int64_t classify(const Slice<T>& slice, T threshold) {
    // The processor's own prefetching stops at each page's end. This is one page ahead.
    constexpr std::int64_t kAhead = 4096 / sizeof(T);
    std::int64_t non_finite = 0;
    for (std::int64_t y = 0; y < slice.ny; ++y) {
        const T* samples = slice.row(y);
        std::uint64_t* words = slice.words(y);
        for (std::int64_t w = 0; w < slice.word_count(); ++w) {
            prefetch(samples + 64 * w + kAhead);
            words[w] = classify_samples(samples + 64 * w, slice.nx - 64 * w, threshold, non_finite);
        }
    }
    return non_finite;
}

// Calls f(block x, block y, first row, rows) for every block of a slice.
template <class T, class F>
void for_each_block(const Slice<T>& slice, const BlockRanges& ranges, const F& f) {
    for (std::int64_t by = 0; by < ranges.blocks_y; ++by) {
        const std::int64_t y = by * BlockRanges::kRows;
        const std::int64_t rows = std::min(BlockRanges::kRows, slice.ny - y);
        for (std::int64_t bx = 0; bx < ranges.blocks_x; ++bx) f(bx, by, y, rows);
    }
}

template <class T>
std::int64_t classify_with_ranges(const Slice<T>& slice, T threshold, BlockRanges& ranges) {
    std::int64_t non_finite = 0;
    for_each_block(
        slice, ranges, [&](std::int64_t bx, std::int64_t by, std::int64_t y, std::int64_t rows) HWY_ATTR {
            const std::int64_t x = 64 * bx, count = std::min<std::int64_t>(64, slice.nx - x);
            for (std::int64_t row = y; row < y + rows; ++row) {
                prefetch(slice.row(row + BlockRanges::kRows) + x);
                slice.words(row)[bx] =
                    classify_samples(slice.row(row) + x, slice.nx - x, threshold, non_finite);
            }
            ranges.at(bx, by, slice.z) = range_of_block(slice.row(y) + x, count, rows, slice.pitch);
        });
    return non_finite;
}

template <class T>
void reclassify(const Slice<T>& slice, double from, double to, T threshold, BlockRanges& ranges) {
    std::int64_t known_non_finite = 0;
    for_each_block(
        slice, ranges, [&](std::int64_t bx, std::int64_t by, std::int64_t y, std::int64_t rows) HWY_ATTR {
            const BlockRange& range = ranges.at(bx, by, slice.z);
            const BlockState state = range.state(to);
            if (state != BlockState::mixed && state == range.state(from)) return;
            const std::int64_t x = 64 * bx, count = std::min<std::int64_t>(64, slice.nx - x);
            const std::uint64_t full = ~std::uint64_t{0} >> (64 - count);
            for (std::int64_t row = y; row < y + rows; ++row) {
                std::uint64_t& word = slice.words(row)[bx];
                if (state == BlockState::mixed)
                    word = classify_samples(slice.row(row) + x, slice.nx - x, threshold, known_non_finite);
                else
                    word = state == BlockState::inside ? full : 0;
            }
        });
}

// Makes all samples of a slice outside.
template <class T>
void clear(const Slice<T>& slice) {
    for (std::int64_t y = 0; y < slice.ny; ++y)
        std::fill_n(slice.words(y), slice.word_count(), std::uint64_t{0});
}

std::int64_t classify_any(const VolumeView& volume, double isovalue, std::int64_t z, InsideBits& bits,
                          BlockRanges* ranges) {
    return visit_sample_type(volume.type, [&](auto sample) -> std::int64_t {
        using T = decltype(sample);
        const Slice<T> slice(volume, z, bits);
        const auto threshold = inside_threshold<T>(isovalue);
        // If no T is inside, the largest T replaces the threshold, and the bits are cleared afterwards.
        const T lowest_inside = threshold.value_or(std::numeric_limits<T>::max());
        const std::int64_t non_finite = ranges != nullptr
                                            ? classify_with_ranges(slice, lowest_inside, *ranges)
                                            : classify(slice, lowest_inside);
        if (!threshold) clear(slice);
        return non_finite;
    });
}

void reclassify_any(const VolumeView& volume, double from, double to, std::int64_t z, InsideBits& bits,
                    BlockRanges& ranges) {
    visit_sample_type(volume.type, [&](auto sample) {
        using T = decltype(sample);
        const Slice<T> slice(volume, z, bits);
        // The ranges of blocks are rounded, so they may reach an isovalue that is above every T.
        if (const auto threshold = inside_threshold<T>(to))
            reclassify(slice, from, to, *threshold, ranges);
        else
            clear(slice);
    });
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(classify_any);
HWY_EXPORT(reclassify_any);

namespace {

// Makes everything around the volume outside: rows of grid slice z beside it, and the words before and after
// its samples.
void clear_padding(const std::array<std::int64_t, 3>& dims, InsideBits& bits, std::int64_t grid_z) {
    const bool slice_outside = grid_z < bits.first_z || grid_z - bits.first_z >= dims[2];
    const auto before = static_cast<std::size_t>(bits.first_x / 64),
               end = before + static_cast<std::size_t>((dims[0] + 63) / 64);
    if (!slice_outside && bits.ny == dims[1] && before == 0 && end == bits.words_per_row) return;
    for (std::int64_t y = 0; y < bits.ny; ++y) {
        const bool row_outside = slice_outside || y < bits.first_y || y - bits.first_y >= dims[1];
        std::uint64_t* const row = bits.row(bits.row_index(y, grid_z));
        std::fill(row, row + (row_outside ? bits.words_per_row : before), std::uint64_t{0});
        std::fill(row + end, row + bits.words_per_row, std::uint64_t{0});
    }
}

bool in_volume(const VolumeView& volume, std::int64_t z) {
    return z >= 0 && z < volume.geometry.dims[2];
}

}  // namespace

std::int64_t classify_slice(const VolumeView& volume, double isovalue, std::int64_t grid_z, InsideBits& bits,
                            BlockRanges* ranges) noexcept {
    clear_padding(volume.geometry.dims, bits, grid_z);
    const std::int64_t z = grid_z - bits.first_z;
    return in_volume(volume, z) ? HWY_DYNAMIC_DISPATCH(classify_any)(volume, isovalue, z, bits, ranges) : 0;
}

void reclassify_slice(const VolumeView& volume, double from, double to, std::int64_t grid_z, InsideBits& bits,
                      BlockRanges& ranges) noexcept {
    const std::int64_t z = grid_z - bits.first_z;
    if (in_volume(volume, z)) HWY_DYNAMIC_DISPATCH(reclassify_any)(volume, from, to, z, bits, ranges);
}

}  // namespace marrow::internal
#endif
