// Finds candidates with bit logic, and lists them with vectors.
#define HWY_WANT_AVX3_DL 1  // which lists cells without branches
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/marching_cubes/candidate_cells.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <array>

#include "candidate_cells.h"
#include "cell_rows-inl.h"
#include "row_bits-inl.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

// Returns how many cells were listed.
std::size_t list_candidates(const InsideBits& bits, std::size_t row, const std::uint64_t* masks,
                            std::size_t mask_count, std::uint32_t* HWY_RESTRICT x,
                            std::uint8_t* HWY_RESTRICT cases) {
    const RowBits row_bits(bits, GridRow(bits, row));
    const std::uint32_t* const begin = x;
    for_each_marked_word(masks, mask_count, [&](std::size_t w) HWY_ATTR {
        const CellVecs cells(row_bits, w);
        const std::uint64_t which =
            hn::GetLane(hn::Or(have_ambiguous_faces(cells), have_antipodes(cells))) & row_bits.valid(w);
        x = list_indices(which, static_cast<std::uint32_t>(64 * w), x);
        cases = CellRows(row_bits, w).list(which, cases);
    });
    return static_cast<std::size_t>(x - begin);
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(list_candidates);

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

void CandidateCells::add_row(const InsideBits& bits, std::size_t row, const std::uint64_t* masks,
                             std::size_t mask_count) {
    const std::size_t most = size_ + 64 * (bits.words_per_row + 1);  // lists are overwritten beyond their end
    if (most > x_.size()) {
        x_.resize(2 * most);
        cases_.resize(2 * most);
    }
    size_ += HWY_DYNAMIC_DISPATCH(list_candidates)(bits, row, masks, mask_count, x_.data() + size_,
                                                   cases_.data() + size_);
}

}  // namespace marrow::internal
#endif
