// Finds the crossed edges of a label map by comparing rows of samples, and from them its active and
// multi-label cells.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/surface_nets/borders.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <limits>
#include <string>

#include <marrow/error.h>

#include "base/checked_size.h"
#include "base/parallel.h"
#include "borders.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Compares 64 samples with 64 others; a bit is set where they differ.
template <class T>
HWY_INLINE std::uint64_t compare_64(const T* a, const T* b) {
    const hn::ScalableTag<T> d;
    constexpr std::size_t kLanes = hn::MaxLanes(d);
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < 64; i += kLanes) {
        std::uint64_t lanes = 0;
        hn::StoreMaskBits(d, hn::Ne(hn::LoadU(d, a + i), hn::LoadU(d, b + i)),
                          reinterpret_cast<std::uint8_t*>(&lanes));
        bits |= lanes << i;
    }
    return bits;
}

// Sets bit i + 1 of `words` where a[i] and b[i] differ. Words without any such i are not written.
template <class T>
void mark_differences(const T* a, const T* b, std::int64_t count, std::uint64_t* words) {
    std::uint64_t carry = 0;
    const auto append = [&](std::uint64_t bits) {
        *words++ = bits << 1 | carry;
        carry = bits >> 63;
    };
    std::int64_t done = 0;
    for (; done + 64 <= count; done += 64) append(compare_64(a + done, b + done));
    if (done < count) {
        std::uint64_t rest = 0;
        if (count >= 64) {
            rest = compare_64(a + count - 64, b + count - 64) >> (64 - (count - done));
        } else {
            for (std::int64_t i = 0; i < count; ++i) rest |= std::uint64_t{a[i] != b[i]} << i;
        }
        append(rest);
    }
    if (carry != 0) *words = carry;
}

template <class T>
void mark_edges_of_type(const LabelReader<T>& labels, std::int64_t k, BorderBits& bits) {
    const auto [nx, ny, nz] = labels.dims;
    const std::vector<T> outside(static_cast<std::size_t>(nx), labels.background);
    const auto samples = [&](std::int64_t j, std::int64_t slice) {
        const T* row = labels.row(j, slice);
        return row != nullptr ? row : outside.data();
    };
    const std::size_t slice_begin = bits.first_word(0, k), slice_end = bits.first_word(0, k + 1);
    for (auto& crossed : bits.crossed)
        std::fill_n(&crossed[slice_begin], slice_end - slice_begin, std::uint64_t{0});
    if (k > nz) return;
    for (std::int64_t j = 0; j <= ny; ++j) {
        const std::size_t row = bits.first_word(j, k);
        const T* here = samples(j, k);
        if (k >= 1) mark_differences(here, samples(j + 1, k), nx, &bits.crossed[1][row]);
        if (j >= 1) mark_differences(here, samples(j, k + 1), nx, &bits.crossed[2][row]);
        if (j < 1 || k < 1) continue;
        std::uint64_t* const x_edges = &bits.crossed[0][row];
        mark_differences(here, here + 1, nx - 1, x_edges);
        x_edges[0] |= std::uint64_t{here[0] != labels.background};
        x_edges[nx >> 6] |= std::uint64_t{here[nx - 1] != labels.background} << (nx & 63);
    }
}

// Marks the crossed edges that begin in slice k of samples.
void mark_edges(const LabelMap& map, std::int64_t k, BorderBits& bits) {
    visit_sample_type(map.type,
                      [&](auto sample) { mark_edges_of_type(LabelReader<decltype(sample)>(map), k, bits); });
}

// As CrossedEdges::word, for as many words as a vector has.
template <class D>
HWY_INLINE hn::Vec<D> load_words(D d, const CrossedEdges& crossed, std::size_t e, std::size_t w) {
    const std::uint64_t* const bits = crossed.bits_of_edge[e] + w;
    const auto words = hn::LoadU(d, bits);
    if (!CrossedEdges::is_at_upper_x(e)) return words;
    return hn::Or(hn::ShiftRight<1>(words), hn::ShiftLeft<63>(hn::LoadU(d, bits + 1)));
}

// The multi-label cells, by the crossed edges of cells. They have a face with three or four crossed edges, or
// two opposite corners whose edges are all crossed. In every other active cell, each face has two crossed
// edges or none. Such edges separate the same two labels, and all crossed edges of the cell are connected.
template <class V>
HWY_INLINE V multi_label_cells(const V (&e)[kCellEdges]) {
    const auto three_of = [](V a, V b, V c, V d) HWY_ATTR {
        return hn::Or(hn::And(hn::And(a, b), hn::Or(c, d)), hn::And(hn::And(c, d), hn::Or(a, b)));
    };
    const auto all_of = [](V a, V b, V c, V d, V f, V g) HWY_ATTR {
        return hn::And(hn::And(hn::And(a, b), hn::And(c, d)), hn::And(f, g));
    };
    const V x_faces = hn::Or(three_of(e[4], e[5], e[6], e[7]), three_of(e[8], e[9], e[10], e[11])),
            y_faces = hn::Or(three_of(e[0], e[2], e[6], e[10]), three_of(e[1], e[3], e[7], e[11])),
            z_faces = hn::Or(three_of(e[0], e[1], e[4], e[8]), three_of(e[2], e[3], e[5], e[9])),
            corners_0_7 = all_of(e[0], e[4], e[6], e[3], e[9], e[11]),
            corners_1_6 = all_of(e[0], e[8], e[10], e[3], e[5], e[7]),
            corners_2_5 = all_of(e[1], e[4], e[7], e[2], e[9], e[10]),
            corners_3_4 = all_of(e[1], e[8], e[11], e[2], e[5], e[6]);
    return hn::Or(hn::Or(hn::Or(x_faces, y_faces), hn::Or(z_faces, corners_0_7)),
                  hn::Or(hn::Or(corners_1_6, corners_2_5), corners_3_4));
}

// Marks the cells of as many words as a vector has, from word w of the row on.
template <class D>
HWY_INLINE void mark_words(D d, const CrossedEdges& crossed, std::size_t w, std::uint64_t* active,
                           std::uint64_t* multi_label) {
    hn::Vec<D> e[kCellEdges];
    for (std::size_t edge = 0; edge < kCellEdges; ++edge) e[edge] = load_words(d, crossed, edge, w);
    // Edges 0 to 6 connect all eight corners: these have the same label unless one of the edges is crossed.
    const auto any = hn::Or(hn::Or(hn::Or(e[0], e[1]), hn::Or(e[2], e[3])), hn::Or(hn::Or(e[4], e[5]), e[6]));
    hn::StoreU(any, d, active + w);
    hn::StoreU(multi_label_cells(e), d, multi_label + w);
}

// Marks the active and the multi-label cells of slice k.
void mark_cells(std::int64_t k, BorderBits& bits) {
    const std::size_t begin = bits.first_word(0, k), size = bits.first_word(0, k + 1) - begin;
    std::uint64_t* const active = &bits.active[begin];
    std::uint64_t* const multi_label = &bits.multi_label[begin];
    std::size_t w = 0;
    if (k < bits.cell_slices()) {
        // Rows follow each other in memory, so the words of the slice are treated as one row.
        const CrossedEdges crossed(bits, 0, k);
        const std::size_t end = bits.first_word(bits.cell_rows(), k) - begin;
        const hn::ScalableTag<std::uint64_t> d;
        for (; w + hn::Lanes(d) <= end; w += hn::Lanes(d)) mark_words(d, crossed, w, active, multi_label);
        for (; w < end; ++w) mark_words(hn::CappedTag<std::uint64_t, 1>(), crossed, w, active, multi_label);
    }
    // There are no cells beyond the last row and slice.
    std::fill_n(active + w, size - w, std::uint64_t{0});
    std::fill_n(multi_label + w, size - w, std::uint64_t{0});
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

namespace {

HWY_EXPORT(mark_edges);
HWY_EXPORT(mark_cells);

// Counts the active cells before each word of slice k in its row. The entries of first_cell get the number of
// active cells in each row; find_borders() adds them up.
void count_cells(std::int64_t k, BorderBits& bits) {
    for (std::int64_t j = 0; j <= bits.cell_rows(); ++j) {
        const std::size_t row = bits.first_word(j, k);
        std::uint32_t count = 0;
        for (std::size_t word = row; word < row + bits.words; ++word) {
            bits.cells_before[word] = count;
            count += static_cast<std::uint32_t>(std::popcount(bits.active[word]));
        }
        bits.first_cell[bits.row(j, k)] = count;
    }
}

}  // namespace

BorderBits::BorderBits(const Index3& volume_dims)
    : dims(volume_dims), words(static_cast<std::size_t>((volume_dims[0] + 2 + 63) / 64)) {
    // So that no number of words or rows is cut off.
    const std::uint64_t slices = static_cast<std::uint64_t>(dims[2]) + 3,
                        rows = static_cast<std::uint64_t>(dims[1]) + 2;
    checked_size(slices * rows * words, sizeof(std::uint64_t));
    const std::size_t size = first_word(0, dims[2] + 2);
    for (auto& bits : crossed) bits.resize(size);
    active.resize(size);
    multi_label.resize(size);
    cells_before.resize(size);
    first_cell.resize(row(0, dims[2] + 2) + 1);
}

BorderBits find_borders(const LabelMap& map, const Progress& progress) {
    BorderBits bits(map.dims);
    Stage stage(progress, 0, 1, static_cast<std::size_t>(bits.cell_slices()));
    parallel_for(std::int64_t{0}, bits.cell_slices() + 1, [&](std::int64_t k) {
        HWY_DYNAMIC_DISPATCH(mark_edges)(map, k, bits);
        if (k < bits.cell_slices()) stage.step();
    });
    parallel_for(std::int64_t{0}, bits.cell_slices() + 1, [&](std::int64_t k) {
        HWY_DYNAMIC_DISPATCH(mark_cells)(k, bits);
        count_cells(k, bits);
    });
    std::uint64_t total = 0;
    for (std::uint32_t& first : bits.first_cell) {
        const std::uint32_t count = first;
        first = static_cast<std::uint32_t>(total);
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
