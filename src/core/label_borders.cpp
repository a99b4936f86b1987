#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "label_borders.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>

#include "dispatch.h"
#include "label_borders.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// One bit each for up to 64 samples: whether they differ.
template <class T>
HWY_INLINE std::uint64_t differences(const T* a, const T* b, std::int64_t count) {
    std::uint64_t bits = 0;
    if (HWY_UNLIKELY(count < 64)) {
        for (std::int64_t i = 0; i < count; ++i) bits |= std::uint64_t{a[i] != b[i]} << i;
        return bits;
    }
    const hn::ScalableTag<T> d;
    constexpr std::size_t kLanes = hn::MaxLanes(d);
    for (std::size_t i = 0; i < 64; i += kLanes) {
        std::uint64_t some = 0;
        hn::StoreMaskBits(d, hn::Ne(hn::LoadU(d, a + i), hn::LoadU(d, b + i)),
                          reinterpret_cast<std::uint8_t*>(&some));
        bits |= some << i;
    }
    return bits;
}

// Sets bits 1 to count where a and b differ.
template <class T>
void mark_differences(const T* a, const T* b, std::int64_t count, std::uint64_t* words) {
    std::uint64_t carry = 0;
    for (std::int64_t s = 0; s < count; s += 64) {
        const std::uint64_t bits = differences(a + s, b + s, count - s);
        *words++ = bits << 1 | carry;
        carry = bits >> 63;
    }
    if (count % 64 == 0 && count > 0 && carry != 0) *words = carry;
}

template <class T>
void mark_slice(const LabelReader<T>& labels, std::int64_t k, BorderBits& bits) {
    const auto [nx, ny, nz] = labels.dims;
    const std::vector<T> outside(static_cast<std::size_t>(nx), labels.background);
    const auto samples = [&](std::int64_t j, std::int64_t slice) {
        const T* row = labels.row(j, slice);
        return row != nullptr ? row : outside.data();
    };
    for (std::int64_t j = 0; j <= ny; ++j) {
        const std::size_t row = bits.row(j, k);
        const T* here = samples(j, k);
        if (k >= 1) mark_differences(here, samples(j + 1, k), nx, &bits.crossed[1][row]);
        if (j >= 1) mark_differences(here, samples(j, k + 1), nx, &bits.crossed[2][row]);
        if (j < 1 || k < 1) continue;
        std::uint64_t* along = &bits.crossed[0][row];
        mark_differences(here, here + 1, nx - 1, along);
        along[0] |= std::uint64_t{here[0] != labels.background};
        along[nx >> 6] |= std::uint64_t{here[nx - 1] != labels.background} << (nx & 63);
    }
}

void mark_slice_any(SampleType type, const void* samples, const Index3& dims, std::int64_t background,
                    std::int64_t k, BorderBits& bits) {
    with_sample_type(type, [&](auto sample) {
        using T = decltype(sample);
        const LabelReader<T> labels{static_cast<const T*>(samples), dims, static_cast<T>(background)};
        mark_slice(labels, k, bits);
    });
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <tbb/parallel_for.h>

namespace marrow::internal {

HWY_EXPORT(mark_slice_any);

BorderBits::BorderBits(const Index3& volume_dims)
    : dims(volume_dims), words(static_cast<std::size_t>((volume_dims[0] + 2 + 63) / 64)) {
    const std::size_t size = row(0, dims[2] + 2);
    for (auto& bits : crossed) bits.assign(size, 0);
    active.assign(size, 0);
}

template <class T>
void mark_borders(const LabelReader<T>& labels, BorderBits& bits, Stage& stage) {
    const std::int64_t slices = labels.dims[2] + 1;
    tbb::parallel_for(std::int64_t{0}, slices, [&](std::int64_t k) {
        HWY_DYNAMIC_DISPATCH(mark_slice_any)
        (sample_type_of<T>(), labels.samples, labels.dims, static_cast<std::int64_t>(labels.background), k,
         bits);
        stage.step();
    });
    // A cell is active unless its eight corners are alike: seven edges that join them all tell.
    tbb::parallel_for(std::int64_t{0}, slices, [&](std::int64_t k) {
        const auto& [x, y, z] = bits.crossed;
        for (std::int64_t j = 0; j <= labels.dims[1]; ++j) {
            const std::size_t r = bits.row(j, k), next_j = bits.row(j + 1, k), next_k = bits.row(j, k + 1),
                              next_jk = bits.row(j + 1, k + 1);
            for (std::size_t w = 0; w < bits.words; ++w) {
                bits.active[r + w] = x[r + w] | x[next_j + w] | x[next_k + w] | x[next_jk + w] | y[r + w] |
                                     y[next_k + w] | z[r + w];
            }
        }
    });
}

template void mark_borders(const LabelReader<std::uint8_t>&, BorderBits&, Stage&);
template void mark_borders(const LabelReader<std::int8_t>&, BorderBits&, Stage&);
template void mark_borders(const LabelReader<std::uint16_t>&, BorderBits&, Stage&);
template void mark_borders(const LabelReader<std::int16_t>&, BorderBits&, Stage&);
template void mark_borders(const LabelReader<std::int32_t>&, BorderBits&, Stage&);
template void mark_borders(const LabelReader<float>&, BorderBits&, Stage&);
template void mark_borders(const LabelReader<double>&, BorderBits&, Stage&);

}  // namespace marrow::internal
#endif
