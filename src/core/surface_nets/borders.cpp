#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/surface_nets/borders.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>

#include "borders.h"
#include "core/grid/case_table.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// One bit each for 64 samples: whether they differ.
template <class T>
HWY_INLINE std::uint64_t differences(const T* a, const T* b) {
    const hn::ScalableTag<T> d;
    constexpr std::size_t kLanes = hn::MaxLanes(d);
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < 64; i += kLanes) {
        std::uint64_t some = 0;
        hn::StoreMaskBits(d, hn::Ne(hn::LoadU(d, a + i), hn::LoadU(d, b + i)),
                          reinterpret_cast<std::uint8_t*>(&some));
        bits |= some << i;
    }
    return bits;
}

// Sets bits 1 to count where a and b differ; the words' others are 0.
template <class T>
void mark_differences(const T* a, const T* b, std::int64_t count, std::uint64_t* words) {
    std::uint64_t carry = 0;
    std::int64_t s = 0;
    const auto put = [&](std::uint64_t bits) {
        *words++ = bits << 1 | carry;
        carry = bits >> 63;
    };
    for (; s + 64 <= count; s += 64) put(differences(a + s, b + s));
    if (s < count) {
        std::uint64_t rest = 0;
        if (count >= 64) {
            rest = differences(a + count - 64, b + count - 64) >> (64 - (count - s));
        } else {
            for (std::int64_t i = 0; i < count; ++i) rest |= std::uint64_t{a[i] != b[i]} << i;
        }
        put(rest);
    }
    if (carry != 0) *words = carry;
}

template <class T>
void mark_slice(const LabelReader<T>& labels, std::int64_t k, BorderBits& bits) {
    const auto [nx, ny, nz] = labels.dims;
    const std::vector<T> outside(static_cast<std::size_t>(nx), labels.background);
    const auto samples = [&](std::int64_t j, std::int64_t slice) {
        const T* row = labels.row(j, slice);
        return row != nullptr ? row : outside.data();
    };
    for (auto& crossed : bits.crossed)
        std::fill_n(&crossed[bits.row(0, k)], bits.row(0, k + 1) - bits.row(0, k), std::uint64_t{0});
    if (k > nz) return;
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

void mark_slice_any(const LabelMap& map, std::int64_t k, BorderBits& bits) {
    visit_sample_type(map.type,
                      [&](auto sample) { mark_slice(LabelReader<decltype(sample)>(map), k, bits); });
}

// The cells of which a face has three crossed edges or four; or which have two antipodes that each differ from all their
// neighbours. All others have two labels and one patch: as each face has two crossed edges or none, what it joins lies between
// the same two labels.
template <class Bits>
HWY_INLINE Bits complex_cells(const Bits (&e)[12]) {
    const auto three = [](Bits a, Bits b, Bits c, Bits d) { return (a & b & (c | d)) | (c & d & (a | b)); };
    return three(e[4], e[5], e[6], e[7]) | three(e[8], e[9], e[10], e[11]) | three(e[0], e[2], e[6], e[10]) |
           three(e[1], e[3], e[7], e[11]) | three(e[0], e[1], e[4], e[8]) | three(e[2], e[3], e[5], e[9]) |
           (e[0] & e[4] & e[6] & e[3] & e[9] & e[11]) | (e[0] & e[8] & e[10] & e[3] & e[5] & e[7]) |
           (e[1] & e[4] & e[7] & e[2] & e[9] & e[10]) | (e[1] & e[8] & e[11] & e[2] & e[5] & e[6]);
}

// Marks the active cells of as many words as fit into Bits, from word w of row (j, k) on.
template <class Bits>
HWY_INLINE void mark_cells_of(std::int64_t j, std::int64_t k, std::size_t w, BorderBits& bits) {
    const CrossedEdges<Bits> crossed(bits, j, k, w);
    const auto& e = crossed.edges;
    // A cell is active unless its eight corners are alike: seven edges that join them all tell.
    const Bits active = e[0] | e[1] | e[2] | e[3] | e[4] | e[5] | e[6], complex = complex_cells(e);
    std::memcpy(&bits.active[bits.row(j, k) + w], &active, sizeof active);
    std::memcpy(&bits.complex[bits.row(j, k) + w], &complex, sizeof complex);
}

// Marks the active cells of a slice; leaves how many each row has in the row's place of first_of_row.
void mark_cells(std::int64_t k, BorderBits& bits) {
    using TwoWords = std::uint64_t __attribute__((vector_size(16)));
    const std::size_t first = bits.row(0, k), last = bits.row(0, k + 1);
    std::size_t w = 0;
    if (k <= bits.dims[2]) {
        const std::size_t end = bits.row(bits.dims[1] + 1, k) - first;
        for (; w + 2 <= end; w += 2) mark_cells_of<TwoWords>(0, k, w, bits);
        for (; w < end; ++w) mark_cells_of<std::uint64_t>(0, k, w, bits);
    }
    // Beyond the last slice and row of cells there is none.
    std::fill_n(&bits.active[first + w], last - first - w, std::uint64_t{0});
    std::fill_n(&bits.complex[first + w], last - first - w, std::uint64_t{0});
    for (std::int64_t j = 0; j < bits.dims[1] + 2; ++j) {
        const std::size_t row = bits.row(j, k);
        std::uint32_t count = 0;
        for (std::size_t word = row; word < row + bits.words; ++word) {
            bits.before[word] = count;
            count += static_cast<std::uint32_t>(__builtin_popcountll(bits.active[word]));
        }
        bits.first_of_row[bits.row_number(j, k)] = count;
    }
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <limits>
#include <string>

#include <tbb/parallel_for.h>

namespace marrow::internal {

HWY_EXPORT(mark_slice_any);
HWY_EXPORT(mark_cells);

BorderBits::BorderBits(const Index3& volume_dims)
    : dims(volume_dims), words(static_cast<std::size_t>((volume_dims[0] + 2 + 63) / 64)) {
    const std::size_t size = row(0, dims[2] + 2);
    for (auto& bits : crossed) bits.resize(size);
    active.resize(size);
    complex.resize(size);
    before.resize(size);
    first_of_row.resize(row_number(0, dims[2] + 2) + 1);
}

BorderBits find_borders(const LabelMap& map, Stage& stage) {
    BorderBits bits(map.dims);
    tbb::parallel_for(std::int64_t{0}, map.dims[2] + 2, [&](std::int64_t k) {
        HWY_DYNAMIC_DISPATCH(mark_slice_any)(map, k, bits);
        if (k <= map.dims[2]) stage.step();
    });
    tbb::parallel_for(std::int64_t{0}, map.dims[2] + 2, [&](std::int64_t k) {
        HWY_DYNAMIC_DISPATCH(mark_cells)(k, bits);
    });
    std::uint64_t total = 0;
    for (std::uint32_t& row : bits.first_of_row) {
        const std::uint32_t count = row;
        row = static_cast<std::uint32_t>(total);
        total += count;
        if (total >= std::numeric_limits<std::uint32_t>::max()) throw_too_many_label_points(total);
    }
    return bits;
}

void throw_too_many_label_points(std::uint64_t points) {
    throw LimitError("the label map's surfaces have " + std::to_string(points) +
                     " points, more than the 2^32 - 1 that triangles can name; crop or coarsen it");
}

}  // namespace marrow::internal
#endif
