// Finds the samples whose points may merge, 64 samples at a time: rules 1 and 2 of docs/algorithm.md.
#include <algorithm>
#include <bit>

#include "merge_clusters.h"

namespace marrow::internal {

namespace {

// The inside bits of a row and of the rows around it. A row outside the grid is replaced by the last one.
struct RowsAround {
    const std::uint64_t* rows[3][3];  // by y and z; [1][1] is the row itself
    std::size_t words;

    RowsAround(const InsideBits& bits, std::int64_t y, std::int64_t z) : words(bits.words_per_row) {
        for (std::int64_t j = 0; j < 3; ++j) {
            for (std::int64_t k = 0; k < 3; ++k) {
                rows[j][k] = bits.row(bits.row_index(std::clamp<std::int64_t>(y + j - 1, 0, bits.ny - 1),
                                                     std::clamp<std::int64_t>(z + k - 1, 0, bits.nz - 1)));
            }
        }
    }
    // For each sample of word w of a row, the next sample along x, or the one before.
    std::uint64_t next_x(const std::uint64_t* row, std::size_t w) const {
        return row[w] >> 1 | (w + 1 < words ? row[w + 1] << 63 : 0);
    }
    std::uint64_t before_x(const std::uint64_t* row, std::size_t w) const {
        return shift_x(row[w], w > 0 ? row[w - 1] : 0);
    }
};

// A word of samples: its row in the grid, its index in the row, and its index in the slice.
struct WordPosition {
    std::int64_t y;
    std::size_t in_row, in_slice;
};

// The points on the edges of a word's samples.
struct IncidentPoints {
    DirectionBits incident;  // the sample is the nearer end of the point's edge
    DirectionBits near;      // and it is within the limit of the point
};

inline IncidentPoints find_incident(const SliceMerge& merge, std::size_t word) {
    const SnapSlice& slice = merge.slice;
    const EdgeBits &here = slice.edges[word], &before_x = slice.edges[word - 1],
                   &before_y = slice.edges[word - slice.stride], &before_z = merge.before.edges[word];
    IncidentPoints points;
    auto& [incident, near] = points;
    incident = {
        here.crossed[0] & ~here.at_second_end[0], shift_x(here.at_second_end[0], before_x.at_second_end[0]),
        here.crossed[1] & ~here.at_second_end[1], before_y.at_second_end[1],
        here.crossed[2] & ~here.at_second_end[2], before_z.at_second_end[2]};
    near = {incident[kPlusX] & here.near[0], incident[kMinusX] & shift_x(here.near[0], before_x.near[0]),
            incident[kPlusY] & here.near[1], incident[kMinusY] & before_y.near[1],
            incident[kPlusZ] & here.near[2], incident[kMinusZ] & before_z.near[2]};
    return points;
}

// The proof for an open surface mirrors the volume in the faces of its box. There a sample in a face has
// points in both directions of the axis across that face, so no point on this axis may merge.
void exclude_at_border(const SliceMerge& merge, const WordPosition& at, DirectionBits& eligible) {
    const InsideBits& bits = merge.input.bits;
    if (at.y == 0 || at.y + 1 == bits.ny) eligible[kPlusY] = eligible[kMinusY] = 0;
    if (merge.z == 0 || merge.z + 1 == bits.nz) eligible[kPlusZ] = eligible[kMinusZ] = 0;
    std::uint64_t ends = at.in_row == 0 ? 1 : 0;
    if (at.in_row == static_cast<std::size_t>(bits.cells_x) / 64)
        ends |= bit_at(static_cast<std::uint32_t>(bits.cells_x % 64));
    eligible[kPlusX] &= ~ends;
    eligible[kMinusX] &= ~ends;
}

// A face is ambiguous if two diagonal corners are inside and the two others outside. The points of an outside
// sample in such a face are not neighbours on the surface. Therefore one of them may not merge: the point
// towards the inside corner that is higher along the first of the face's axes.
inline void exclude_ambiguous(const RowsAround& around, std::size_t w, std::uint64_t outside,
                              DirectionBits& eligible) {
    if (outside == 0) return;
    const auto& rows = around.rows;
    const std::uint64_t* const by_y[2] = {rows[2][1], rows[0][1]};  // in directions + and -
    const std::uint64_t* const by_z[2] = {rows[1][2], rows[1][0]};
    const DirectionBits inside = {around.next_x(rows[1][1], w),
                                  around.before_x(rows[1][1], w),
                                  by_y[0][w],
                                  by_y[1][w],
                                  by_z[0][w],
                                  by_z[1][w]};
    // The directions are in the order of the axes. `diagonal`: whether the corner across the face is inside
    const auto exclude = [&](std::uint32_t first, std::uint32_t second, std::uint64_t diagonal) {
        const std::uint64_t ambiguous = outside & inside[first] & inside[second] & ~diagonal;
        eligible[is_negative(first) ? second : first] &= ~ambiguous;
    };
    for (std::uint32_t s = 0; s < 2; ++s) {
        exclude(kPlusX, kPlusY + s, around.next_x(by_y[s], w));
        exclude(kMinusX, kPlusY + s, around.before_x(by_y[s], w));
        exclude(kPlusX, kPlusZ + s, around.next_x(by_z[s], w));
        exclude(kMinusX, kPlusZ + s, around.before_x(by_z[s], w));
        exclude(kPlusY + s, kPlusZ, rows[2 - 2 * s][2][w]);
        exclude(kPlusY + s, kMinusZ, rows[2 - 2 * s][0][w]);
    }
}

// If both points on an axis are eligible, keeps the one in the negative direction, or the other if only that
// one is near.
inline void keep_one_per_axis(const DirectionBits& near, DirectionBits& eligible) {
    for (std::uint32_t plus = kPlusX; plus < kDirections; plus += 2) {
        const std::uint32_t minus = opposite(plus);
        eligible[minus] &= ~(eligible[plus] & near[plus] & ~near[minus]);
        eligible[plus] &= ~eligible[minus];
    }
}

// Lists a cluster for each of the word's samples that has one.
inline void append_clusters(const ClusterWord& word, Clusters& list) {
    Cluster* const clusters = list.clusters.data();
    std::size_t count = list.count;
    const std::size_t end = count + static_cast<std::size_t>(std::popcount(word.clusters));
    // Most words have few clusters, so four are written without a branch. Later ones overwrite the surplus.
    for (std::uint64_t left = word.clusters; count < end; count += 4) {
        for (std::size_t k = 0; k < 4; ++k) {
            clusters[count + k].word = word.word;
            clusters[count + k].bit = static_cast<std::uint32_t>(std::countr_zero(left));
            left &= left - 1;
        }
    }
    list.count = end;
}

inline void select_in_word(const SliceMerge& merge, const RowsAround& around, const WordPosition& at) {
    const auto [incident, near] = find_incident(merge, at.in_slice);
    const std::uint64_t candidates = two_or_more(incident) & any(near);
    if (candidates == 0) return;

    const InsideBits& bits = merge.input.bits;
    DirectionBits eligible, eligible_near;
    for (std::size_t d = 0; d < kDirections; ++d) eligible[d] = incident[d] & candidates;
    if (bits.first_x == 0) exclude_at_border(merge, at, eligible);
    exclude_ambiguous(around, at.in_row, candidates & ~around.rows[1][1][at.in_row], eligible);
    keep_one_per_axis(near, eligible);
    for (std::size_t d = 0; d < kDirections; ++d) eligible_near[d] = eligible[d] & near[d];
    const std::uint64_t with_cluster = two_or_more(eligible) & any(eligible_near);

    Clusters& list = merge.clusters;
    DirectionBits& members = merge.slice.members[at.in_slice];
    ClusterWord& word = list.words[list.word_count++];
    word.word = static_cast<std::uint32_t>(at.in_slice);
    word.first_x = static_cast<std::int32_t>(64 * static_cast<std::int64_t>(at.in_row) - bits.first_x);
    word.y = at.y;
    word.first_cluster = static_cast<std::uint32_t>(list.count);
    word.clusters = with_cluster;
    for (std::size_t d = 0; d < kDirections; ++d) {
        members[d] = eligible[d] & with_cluster;
        word.near[d] = near[d] & candidates;
    }
    append_clusters(word, list);
}

const std::uint64_t* active_row(const SliceMerge& merge, std::int64_t y, std::int64_t z) {
    if (y < 0 || z < 0) return merge.clusters.no_active_words.data();
    return merge.input.active.row(merge.input.bits.row_index(y, z));
}

void select_in_row(const SliceMerge& merge, std::int64_t y) {
    const InsideBits& bits = merge.input.bits;
    SnapSlice& slice = merge.slice;
    Clusters& clusters = merge.clusters;
    const std::size_t masks = merge.input.active.masks_per_row;
    const std::uint64_t *here = active_row(merge, y, merge.z), *before_y = active_row(merge, y - 1, merge.z),
                        *before_z = active_row(merge, y, merge.z - 1);
    std::uint64_t any_active = 0;
    for (std::size_t m = 0; m < masks; ++m) any_active |= here[m] | before_y[m] | before_z[m];
    if (any_active == 0) return;
    const std::size_t first = slice.first_word(y), words_before = clusters.word_count;
    const RowsAround around(bits, y, merge.z);
    std::uint64_t last_here = 0;
    for (std::size_t m = 0; m < masks; ++m) {
        // A word's samples have points on edges that start in it, in the word before, or in the rows before.
        std::uint64_t words = here[m] | shift_x(here[m], last_here) | before_y[m] | before_z[m];
        last_here = here[m];
        if (64 * m + 64 > bits.words_per_row)
            words &= (std::uint64_t{2} << (bits.words_per_row - 1) % 64) - 1;
        for_each_bit(words, [&](std::uint32_t bit) {
            const std::size_t w = 64 * m + bit;
            select_in_word(merge, around, {y, w, first + w});
        });
    }
    slice.rows_in_use[static_cast<std::size_t>(y)] |= clusters.word_count > words_before;
}

}  // namespace

void select_candidates(const SliceMerge& merge) {
    for (std::int64_t y = 0; y < merge.input.bits.ny; ++y) select_in_row(merge, y);
}

}  // namespace marrow::internal
