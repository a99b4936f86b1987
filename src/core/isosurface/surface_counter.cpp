// Finds the runs of each row, and connects those of neighbouring rows.
#include "surface_counter.h"

#include <algorithm>
#include <bit>

namespace marrow::internal {

void ConnectedRuns::add(std::size_t known, std::size_t runs) {
    if (parents_.size() < runs) parents_.resize(2 * runs);
    for (std::size_t run = known; run < runs; ++run) parents_[run] = static_cast<std::uint32_t>(run);
}

// The numbers of runs follow from those of borders: a row with n inside runs has n + 1 outside runs and 2 n +
// 2 borders.
void SurfaceCounter::add_row(const InsideBits& bits, std::size_t row) {
    const auto end = static_cast<std::int32_t>(64 * bits.words_per_row);
    const std::size_t first = first_border_[row];
    if (const std::size_t most = first + static_cast<std::size_t>(end) + 3; borders_.size() < most)
        borders_.resize(2 * most);
    std::int32_t* next = &borders_[first];
    *next++ = 0;  // the row starts outside
    const std::uint64_t* words = bits.row(row);
    std::uint64_t before = 0;  // the last bit of the word before
    for (std::size_t w = 0; w < bits.words_per_row; ++w) {
        std::uint64_t changes = words[w] ^ (words[w] << 1 | before);
        before = words[w] >> 63;
        for (; changes != 0; changes &= changes - 1)
            *next++ = static_cast<std::int32_t>(64 * w) + std::countr_zero(changes);
    }
    if (before != 0) *next++ = end;  // the row ends outside
    *next++ = end + 1;
    const auto borders = static_cast<std::size_t>(next - borders_.data());
    first_border_.push_back(borders);
    inside_.add(first / 2 - row, borders / 2 - (row + 1));
    outside_.add(first / 2, borders / 2);
    // Rows begin and end outside the volume.
    outside_.connect(first / 2, 0);
    outside_.connect(borders / 2 - 1, 0);
}

// Connects the runs of two neighbouring rows that touch; outside runs also if they touch only diagonally.
template <bool kInside>
void SurfaceCounter::connect_rows(std::size_t row, std::size_t other) {
    constexpr std::int32_t kReach = kInside ? 0 : 1;
    const std::size_t skipped = kInside ? 1 : 0;
    const std::int32_t *a = &borders_[first_border_[other]] + skipped,
                       *b = &borders_[first_border_[row]] + skipped;
    const std::int32_t *const a_end = &borders_[first_border_[other + 1] - 1],
                              *const b_end = &borders_[first_border_[row + 1] - 1];
    ConnectedRuns& runs = kInside ? inside_ : outside_;
    std::size_t a_run = first_border_[other] / 2 - (kInside ? other : 0),
                b_run = first_border_[row] / 2 - (kInside ? row : 0);
    while (a < a_end && b < b_end) {
        if (a[0] < b[1] + kReach && b[0] < a[1] + kReach) runs.connect(a_run, b_run);
        const bool a_ends = a[1] < b[1];
        a += a_ends ? 2 : 0;
        a_run += a_ends ? 1 : 0;
        b += a_ends ? 0 : 2;
        b_run += a_ends ? 0 : 1;
    }
}

// The number of the outside run that holds a sample of a row.
std::size_t SurfaceCounter::outside_run(std::size_t row, std::int32_t sample) const {
    const auto first = borders_.begin() + static_cast<std::ptrdiff_t>(first_border_[row]),
               end = borders_.begin() + static_cast<std::ptrdiff_t>(first_border_[row + 1]);
    return first_border_[row] / 2 +
           static_cast<std::size_t>(std::upper_bound(first, end, sample) - first - 1) / 2;
}

// Connects outside samples across the diagonals between two rows. Only diagonals between two inside samples
// matter: otherwise one of the samples beside the diagonal is outside and connects them.
void SurfaceCounter::connect_diagonals(const InsideBits& bits, std::size_t row, std::size_t other,
                                       std::size_t beside_row, std::size_t beside_other) {
    const std::uint64_t *a = bits.row(row), *b = bits.row(other), *c = bits.row(beside_row),
                        *d = bits.row(beside_other);
    std::uint64_t any = 0;
    for (std::size_t w = 0; w < bits.words_per_row; ++w) any |= c[w] & d[w] & ~(a[w] | b[w]);
    if (any == 0) return;
    for (std::size_t w = 0; w < bits.words_per_row; ++w) {
        for (std::uint64_t left = c[w] & d[w] & ~(a[w] | b[w]); left != 0; left &= left - 1) {
            const auto sample = static_cast<std::int32_t>(64 * w) + std::countr_zero(left);
            outside_.connect(outside_run(row, sample), outside_run(other, sample));
        }
    }
}

std::int64_t SurfaceCounter::count(const InsideBits& bits) {
    first_border_.assign(1, 0);
    inside_.restart();
    outside_.restart();
    const auto ny = static_cast<std::size_t>(bits.ny);
    for (std::size_t row = 0; row < bits.rows(); ++row) {
        add_row(bits, row);
        const std::size_t y = row % ny;
        if (y > 0) {
            connect_rows<true>(row, row - 1);
            connect_rows<false>(row, row - 1);
        }
        if (row < ny) continue;
        connect_rows<true>(row, row - ny);
        connect_rows<false>(row, row - ny);
        if (y > 0) connect_diagonals(bits, row, row - ny - 1, row - 1, row - ny);
        if (y + 1 < ny) connect_diagonals(bits, row, row - ny + 1, row + 1, row - ny);
    }
    const std::size_t rows = bits.rows(), outside = first_border_.back() / 2, inside = outside - rows;
    return static_cast<std::int64_t>(inside - inside_.connections() + outside - outside_.connections()) - 1;
}

}  // namespace marrow::internal
