// Finds candidates with bit logic, and lists them with vectors.
#define HWY_WANT_AVX3_DL 1  // which lists cells without branches
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/marching_cubes/candidate_cells.cpp"
#include <hwy/cache_control.h>
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>

#include "candidate_cells.h"
#include "cell_rows-inl.h"
#include "row_bits-inl.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

// Writes `y` for each of `count` cells. Returns their end; up to three elements after it are overwritten.
HWY_INLINE std::uint32_t* repeat(std::uint32_t y, std::size_t count, std::uint32_t* HWY_RESTRICT out) {
    for (std::size_t k = 0; k < count; k += 4) std::fill_n(out + k, 4, y);
    return out + count;
}

// Lists the cells of all words. Returns how many there are.
std::size_t list_undecided(const InsideBits& bits, std::int64_t slice, const Buffer<UndecidedCells>& words,
                           std::uint32_t* x, std::uint32_t* y, std::uint8_t* cases) {
    const std::uint32_t* const begin = x;
    for (const UndecidedCells& some : words) {
        const RowBits row(bits, GridRow(bits, some.y, slice));
        x = list_indices(some.cells, 64 * some.word, x);
        y = repeat(some.y, popcount(some.cells), y);
        cases = CellRows(row, some.word).list(some.cells, cases);
    }
    return static_cast<std::size_t>(x - begin);
}

void find_undecided(const InsideBits& bits, std::int64_t slice, const ActiveWords& active,
                    Buffer<UndecidedCells>& words) {
    const Words d;
    words.clear();
    for (std::int64_t y = 0; y < bits.ny; ++y) {
        const GridRow at(bits, y, slice);
        const RowBits row(bits, at);
        if (!row.has_cells) break;
        std::size_t end = 0;  // of the words that were looked at
        for_each_active_word(active, at.index, [&](std::size_t first) HWY_ATTR {
            if (first < end) return;
            end = std::min(first + hn::Lanes(d), row.words);
            HWY_ALIGN std::uint64_t undecided[hn::MaxLanes(Words())];
            hn::Store(may_be_ambiguous(CellVecs(row, first)), d, undecided);
            for (std::size_t w = first; w < end; ++w) {
                const std::uint64_t cells = undecided[w - first] & row.valid(w);
                if (cells != 0)
                    words.push_back({static_cast<std::uint32_t>(y), static_cast<std::uint32_t>(w), cells});
            }
        });
    }
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(list_undecided);
HWY_EXPORT(find_undecided);

namespace {

// From the order of kRunningCases to that of kCases.
constexpr std::array<std::uint8_t, 256> kCaseOfRunning = [] {
    std::array<std::uint8_t, 256> cases{};
    for (unsigned c = 0; c < 256; ++c) {
        unsigned by_rows = 0;
        for (unsigned v = 0; v < 8; ++v) by_rows |= (c >> v & 1) << (v / 2 + 4 * (v % 2));
        cases[by_rows] = static_cast<std::uint8_t>(c);
    }
    return cases;
}();

}  // namespace

std::uint8_t CandidateCells::cell_case(std::size_t cell) const {
    return kCaseOfRunning[cases_[cell]];
}

void CandidateCells::find_words(const InsideBits& bits, const ActiveWords& active) {
    HWY_DYNAMIC_DISPATCH(find_undecided)(bits, slice, active, words);
}

void CandidateCells::list_cells(const VolumeView& volume, const InsideBits& bits) {
    const std::size_t most = 64 * (words.size() + 1);  // lists are overwritten beyond their end
    if (most > x_.size()) {
        x_.resize(2 * most);
        y_.resize(2 * most);
        cases_.resize(2 * most);
    }
    size_ = HWY_DYNAMIC_DISPATCH(list_undecided)(bits, slice, words, x_.data(), y_.data(), cases_.data());

    const auto bytes = static_cast<std::int64_t>(sample_size(volume.type));
    const auto [nx, ny, nz] = volume.geometry.dims;
    const auto step_y = volume.row_pitch() * bytes, step_z = volume.slice_pitch() * bytes;
    // Cells at the volume's border may have samples beyond it; others are near these.
    const auto within = [](std::int64_t i, std::int64_t n) { return std::clamp<std::int64_t>(i, 0, n - 2); };
    if (nx < 2 || ny < 2 || nz < 2) return;
    const auto* const samples =
        static_cast<const std::uint8_t*>(volume.data) + within(slice - bits.first_z, nz) * step_z;
    for (std::size_t cell = 0; cell < size_; ++cell) {
        const std::uint8_t* const first = samples + within(y_[cell] - bits.first_y, ny) * step_y +
                                          within(x_[cell] - bits.first_x, nx) * bytes;
        for (const std::int64_t row : {std::int64_t{0}, step_y, step_z, step_y + step_z})
            hwy::Prefetch(first + row);
    }
}

}  // namespace marrow::internal
#endif
