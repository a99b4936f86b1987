// Lists candidates with vectors.
#define HWY_WANT_AVX3_DL 1  // which lists cells without branches
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/marching_cubes/candidate_cells.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <array>
#include <bit>

#include "candidate_cells.h"
#include "cell_rows-inl.h"
#include "row_bits-inl.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

void list_candidates(const InsideBits& bits, std::int64_t slice, std::span<const UndecidedCells> undecided,
                     std::uint32_t* HWY_RESTRICT x, std::uint32_t* HWY_RESTRICT y,
                     std::uint8_t* HWY_RESTRICT cases) {
    const std::uint32_t* const begin = x;
    std::uint32_t* const first_y = y;
    const hn::CappedTag<std::uint32_t, 16> d;
    GridRow at(bits, bits.row_index(0, slice));
    for (const UndecidedCells& cells : undecided) {
        at.y = cells.y;
        at.index = bits.row_index(at.y, slice);
        x = list_indices(cells.bits, 64 * cells.word, x);
        cases = CellRows(RowBits(bits, at), cells.word).list(cells.bits, cases);
        const std::uint32_t* const end = first_y + (x - begin);
        for (; y < end; y += hn::Lanes(d)) hn::StoreU(hn::Set(d, cells.y), d, y);
        y = first_y + (x - begin);
    }
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(list_candidates);

// From the order of kRunningCases to that of kCases.
constexpr std::array<std::uint8_t, 256> CandidateCells::kCaseOfRunning = [] {
    std::array<std::uint8_t, 256> cases{};
    for (unsigned c = 0; c < 256; ++c) {
        unsigned by_rows = 0;
        for (unsigned v = 0; v < 8; ++v) by_rows |= (c >> v & 1) << (v / 2 + 4 * (v % 2));
        cases[by_rows] = static_cast<std::uint8_t>(c);
    }
    return cases;
}();

CandidateCells::CandidateCells(const InsideBits& bits, std::int64_t slice,
                               std::span<const UndecidedCells> undecided) {
    for (const UndecidedCells& cells : undecided)
        size_ += static_cast<std::size_t>(std::popcount(cells.bits));
    constexpr std::size_t kBeyond = 64;  // lists are overwritten beyond their end
    x_.resize(size_ + kBeyond);
    y_.resize(size_ + kBeyond);
    cases_.resize(size_ + kBeyond);
    HWY_DYNAMIC_DISPATCH(list_candidates)(bits, slice, undecided, x_.data(), y_.data(), cases_.data());
}

}  // namespace marrow::internal
#endif
