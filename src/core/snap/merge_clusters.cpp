// Which points may join is seen in bits, for 64 samples at a time. The rules, and why they leave a manifold,
// are in docs/algorithm.md; the comments name them by number.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/snap/merge_clusters.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "base/resize_discarding.h"
#include "core/marching_cubes/row_bits-inl.h"
#include "merge_clusters.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

template <class F>
HWY_INLINE void for_each_bit(std::uint64_t bits, const F& f) {
    for (; bits != 0; bits &= bits - 1) f(static_cast<std::uint32_t>(std::countr_zero(bits)));
}

constexpr std::uint64_t bit_at(std::uint32_t bit) {
    return std::uint64_t{1} << bit;
}

// The bits of a row and of those round it, for ambiguous faces. Where the grid ends, a missing row stands for
// its neighbour.
struct RowsAround {
    const std::uint64_t* rows[3][3];  // by y and z, 1: the row itself
    std::size_t words;

    RowsAround(const InsideBits& bits, std::int64_t y, std::int64_t z) : words(bits.words_per_row) {
        for (std::int64_t j = 0; j < 3; ++j) {
            for (std::int64_t k = 0; k < 3; ++k) {
                rows[j][k] = bits.row(bits.row_index(std::clamp<std::int64_t>(y + j - 1, 0, bits.ny - 1),
                                                     std::clamp<std::int64_t>(z + k - 1, 0, bits.nz - 1)));
            }
        }
    }
    // The samples one further along x, and one before.
    std::uint64_t next_x(const std::uint64_t* r, std::size_t w) const {
        return r[w] >> 1 | (w + 1 < words ? r[w + 1] << 63 : 0);
    }
    std::uint64_t before_x(const std::uint64_t* r, std::size_t w) const {
        return r[w] << 1 | (w > 0 ? r[w - 1] >> 63 : 0);
    }
};

class SliceJoiner {
  public:
    SliceJoiner(const EmitInput& input, float limit, std::int64_t z, SnapSlice& before, SnapSlice& slice,
                Crowds& crowds, std::uint32_t* one, float* moved)
        : input_(input),
          bits_(input.bits),
          limit_(limit),
          z_(z),
          before_(before),
          slice_(slice),
          stride_(slice.stride),
          one_(one),
          moved_(moved),
          no_words_(crowds.no_words.data()),
          crowds_(crowds.crowds.data()),
          words_(crowds.words.data()),
          part_(crowds.part.data()),
          furthest_(crowds.furthest.data()) {
        for (std::size_t a = 0; a < 3; ++a) {
            offsets_[a] = crowds.offsets[a].data();
            middle_[a] = crowds.middle[a].data();
        }
    }

    void join() {
        if (slice_.size + before_.size == 0) return;
        for (std::int64_t y = 0; y < bits_.ny; ++y) choose_in_row(y);
        for (std::size_t k = 0; k < count_; ++k) gather(k);
        find_middles();
        for (std::size_t k = 0; k < word_count_; ++k) decide(words_[k]);
        become_one();
    }

  private:
    const std::uint64_t* row_active(std::int64_t y, std::int64_t z) const {
        return y < 0 || z < 0 ? no_words_ : input_.active.row(bits_.row_index(y, z));
    }

    void choose_in_row(std::int64_t y) {
        const std::uint64_t *here = row_active(y, z_), *before_y = row_active(y - 1, z_),
                            *before_z = row_active(y, z_ - 1);
        std::uint64_t any_word = 0;
        for (std::size_t m = 0; m < input_.active.masks_per_row; ++m)
            any_word |= here[m] | before_y[m] | before_z[m];
        if (any_word == 0) return;
        const std::size_t first = slice_.first_word(y);
        const RowsAround rows(bits_, y, z_);
        std::uint64_t carry = 0;
        const std::size_t words_before = word_count_;
        for (std::size_t m = 0; m < input_.active.masks_per_row; ++m) {
            std::uint64_t words = here[m] | here[m] << 1 | carry | before_y[m] | before_z[m];
            carry = here[m] >> 63;
            if (64 * m + 64 > bits_.words_per_row)
                words &= (std::uint64_t{2} << (bits_.words_per_row - 1) % 64) - 1;
            for_each_bit(words, [&](std::uint32_t bit) HWY_ATTR {
                choose_in_word(rows, y, 64 * m + bit, first + 64 * m + bit);
            });
        }
        slice_.in_use[static_cast<std::size_t>(y)] |= word_count_ > words_before;
    }

    static std::uint64_t shifted(std::uint64_t bits, std::uint64_t before) {
        return bits << 1 | before >> 63;
    }

    // The sides on which the points of word w, the `at`th of the slice, may join.
    HWY_INLINE void choose_in_word(const RowsAround& rows, std::int64_t y, std::size_t w, std::size_t at) {
        const WordEdges &here = slice_.edges[at], &before_x = slice_.edges[at - 1],
                        &before_y = slice_.edges[at - stride_], &before_z = before_.edges[at];
        const std::uint64_t second_x = shifted(here.second[0], before_x.second[0]);
        const std::uint64_t own[6] = {here.crossed[0] & ~here.second[0], second_x,
                                      here.crossed[1] & ~here.second[1], before_y.second[1],
                                      here.crossed[2] & ~here.second[2], before_z.second[2]};
        const std::uint64_t near[6] = {
            own[0] & here.near[0], own[1] & shifted(here.near[0], before_x.near[0]),
            own[2] & here.near[1], own[3] & before_y.near[1],
            own[4] & here.near[2], own[5] & before_z.near[2]};
        const std::uint64_t crowded = two_or_more(own) & any(near);
        if (crowded == 0) return;

        // Rule 2. Of two on one axis that are left, the one towards lower indices; but not if only the other
        // is near.
        WordSides may;
        for (std::size_t k = 0; k < 6; ++k) may[k] = own[k] & crowded;
        if (bits_.pad == 0) leave_out_at_border(y, w, may);
        leave_out_ambiguous(rows, w, crowded & ~rows.rows[1][1][w], may);
        for (std::size_t k = 0; k < 6; k += 2) {
            may[k + 1] &= ~(may[k] & near[k] & ~near[k + 1]);
            may[k] &= ~may[k + 1];
        }
        std::uint64_t may_near[6];
        for (std::size_t k = 0; k < 6; ++k) may_near[k] = may[k] & near[k];
        const std::uint64_t can = two_or_more(may.data()) & any(may_near);
        for (std::size_t k = 0; k < 6; ++k) slice_.sides[at][k] = may[k] & can;

        CrowdedWord& word = words_[word_count_++];
        word.word = static_cast<std::uint32_t>(at);
        word.first_x = static_cast<std::int32_t>(64 * static_cast<std::int64_t>(w) - bits_.first_x);
        word.y = y;
        word.first_crowd = static_cast<std::uint32_t>(count_);
        word.can = can;
        for (std::size_t k = 0; k < 6; ++k) word.near[k] = near[k] & crowded;
        // Most words have few. List so many without asking, and overwrite what was too much.
        const std::size_t end = count_ + popcount(can);
        for (std::uint64_t left = can; count_ < end; count_ += 4) {
            for (std::size_t k = 0; k < 4; ++k) {
                crowds_[count_ + k].word = static_cast<std::uint32_t>(at);
                crowds_[count_ + k].bit = static_cast<std::uint32_t>(std::countr_zero(left));
                left &= left - 1;
            }
        }
        count_ = end;
    }

    static HWY_INLINE std::uint64_t two_or_more(const std::uint64_t* sides) {
        std::uint64_t one = 0, two = 0;
        for (std::size_t k = 0; k < 6; ++k) {
            two |= one & sides[k];
            one |= sides[k];
        }
        return two;
    }
    static HWY_INLINE std::uint64_t any(const std::uint64_t* sides) {
        return (sides[0] | sides[1]) | (sides[2] | sides[3]) | (sides[4] | sides[5]);
    }

    // Seen in the mirror of the box's face, a sample there has points on both sides of the axis across.
    void leave_out_at_border(std::int64_t y, std::size_t w, WordSides& may) const {
        if (y == 0 || y + 1 == bits_.ny) may[2] = may[3] = 0;
        if (z_ == 0 || z_ + 1 == bits_.nz) may[4] = may[5] = 0;
        std::uint64_t ends = w == 0 ? 1 : 0;
        if (w == static_cast<std::size_t>(bits_.cells_x) / 64) ends |= bit_at(bits_.cells_x % 64);
        may[0] &= ~ends;
        may[1] &= ~ends;
    }

    // Of outside samples in a face in which both inside corners are cut off, the point towards the one that is
    // higher along the first of the face's axes.
    HWY_INLINE void leave_out_ambiguous(const RowsAround& rows, std::size_t w, std::uint64_t outside,
                                        WordSides& may) const {
        if (outside == 0) return;
        const auto& r = rows.rows;
        const std::uint64_t x[2] = {outside & rows.next_x(r[1][1], w), outside & rows.before_x(r[1][1], w)};
        const std::uint64_t z[2] = {outside & r[1][2][w], outside & r[1][0][w]};
        for (std::size_t j = 0; j < 2; ++j) {
            const std::uint64_t* const in_y = r[2 - 2 * j][1];
            const std::uint64_t* const in_z = r[1][2 - 2 * j];
            const std::uint64_t y = in_y[w],
                                xy[2] = {y & x[0] & ~rows.next_x(in_y, w),
                                         y & x[1] & ~rows.before_x(in_y, w)},
                                xz[2] = {z[j] & x[0] & ~rows.next_x(in_z, w),
                                         z[j] & x[1] & ~rows.before_x(in_z, w)},
                                yz[2] = {y & z[0] & ~r[2 - 2 * j][2][w], y & z[1] & ~r[2 - 2 * j][0][w]};
            may[0] &= ~(xy[0] | xz[0]);
            may[2 + j] &= ~xy[1];
            may[4 + j] &= ~xz[1];
            if (j == 0) {
                may[2] &= ~(yz[0] | yz[1]);
            } else {
                may[4] &= ~yz[0];
                may[5] &= ~yz[1];
            }
        }
    }

    // The edges that hold a word's points on one side, and the slice in which they start.
    struct SideEdges {
        const WordEdges* edges;
        const SnapSlice* slice;
    };
    HWY_INLINE SideEdges side_edges(std::size_t word, std::uint32_t side) const {
        const std::size_t at = side == 3 ? word - stride_ : word;
        const SnapSlice* const slice = side == 5 ? &before_ : &slice_;
        return {slice->edges.data() + at, slice};
    }
    // A point's place in its slice. An edge along x that ends at a sample comes right before the one that
    // starts there.
    static HWY_INLINE std::uint32_t place(const WordEdges& edges, std::uint32_t side, std::uint32_t bit) {
        const std::uint32_t axis = side / 2;
        return edges.first_point[axis] + popcount(edges.crossed[axis] & (bit_at(bit) - 1)) - (side == 1);
    }

    // The value where the mask is all ones, 0 where it is 0: without a branch, which could not be foreseen.
    static HWY_INLINE float masked(float value, std::uint32_t mask) {
        return std::bit_cast<float>(std::bit_cast<std::uint32_t>(value) & mask);
    }

    HWY_INLINE void gather(std::size_t k) {
        Crowd& crowd = crowds_[k];
        const WordSides& sides = slice_.sides[crowd.word];
        const std::uint32_t bit = crowd.bit;
        std::uint32_t one = ~std::uint32_t{0}, count = 0, there[3];
        for (std::uint32_t a = 0; a < 3; ++a) {
            const auto backward = static_cast<std::uint32_t>(sides[2 * a + 1] >> bit & 1);
            const std::uint32_t side = 2 * a + backward;
            const auto is_there = static_cast<std::uint32_t>(sides[side] >> bit & 1);
            const auto [edges, slice] = side_edges(crowd.word, side);
            there[a] = ~is_there + 1;
            const std::uint32_t at = place(*edges, side, bit) & there[a];
            crowd.sides[a] = static_cast<std::uint8_t>(side);
            offsets_[a][k] = masked(slice->offsets[at], there[a]);
            crowd.points[a] = slice->start + at;
            count += is_there;
            const std::uint32_t in_slice = a == 2 ? there[a] & (backward - 1) : there[a];
            one = std::min(one, crowd.points[a] | ~in_slice);
        }
        for (std::size_t a = 0; a < 3; ++a)
            crowd.points[a] = (crowd.points[a] & there[a]) | (one & ~there[a]);
        crowd.one = one;
        part_[k] = count == 3 ? 1.0f / 3 : 1.0f / 2;
        crowd.joins = true;
    }

    // Most become one in their mean. From that, two are equally far, and where there is no third it would be
    // as far.
    void find_middles() {
        const hn::CappedTag<float, Crowds::kSlack> d;
        using V = hn::Vec<decltype(d)>;
        for (std::size_t k = 0; k < count_; k += hn::Lanes(d)) {
            const V part = hn::LoadU(d, part_ + k);
            V offset[3], middle[3], squares[3], furthest = hn::Zero(d);
            for (std::size_t a = 0; a < 3; ++a) {
                offset[a] = hn::LoadU(d, offsets_[a] + k);
                middle[a] = hn::Mul(part, offset[a]);
                squares[a] = hn::Mul(middle[a], middle[a]);
                hn::StoreU(middle[a], d, middle_[a] + k);
            }
            const V squared = hn::Add(hn::Add(squares[0], squares[1]), squares[2]);
            for (std::size_t a = 0; a < 3; ++a) {
                const V along = hn::Sub(offset[a], middle[a]);
                furthest = hn::Max(furthest, hn::Add(hn::Sub(squared, squares[a]), hn::Mul(along, along)));
            }
            furthest = hn::Sqrt(furthest);
            hn::StoreU(furthest, d, furthest_ + k);
        }
        for (std::size_t k = 0; k < count_; ++k)
            if (HWY_UNLIKELY(furthest_[k] > limit_)) find_near_middle(k);
    }

    // Rule 3. The middle of the smallest ball that holds three points, if none is further from that than the
    // limit. On axes that are perpendicular they form a triangle without an obtuse angle: it is their circle's.
    void find_near_middle(std::size_t k) {
        Crowd& crowd = crowds_[k];
        crowd.joins = false;
        if (part_[k] == 0.5f) return;
        const Vec3f offsets{offsets_[0][k], offsets_[1][k], offsets_[2][k]};
        float squared[3], weights[3], whole = 0;
        for (std::size_t a = 0; a < 3; ++a) squared[a] = std::max(offsets[a] * offsets[a], 1e-12f);
        for (std::size_t a = 0; a < 3; ++a) {
            weights[a] = squared[a] * (squared[(a + 1) % 3] + squared[(a + 2) % 3]);
            whole += weights[a];
        }
        // Its radius squared, from the lengths of its sides.
        const float radius = std::sqrt((squared[0] + squared[1]) * (squared[1] + squared[2]) *
                                       (squared[2] + squared[0]) / (2 * whole));
        if (radius <= limit_) {
            for (std::size_t a = 0; a < 3; ++a) middle_[a][k] = weights[a] / whole * offsets[a];
            furthest_[k] = radius;
            crowd.joins = true;
            return;
        }
        // Without the furthest from the sample; or where that is not known to do, with another rather.
        std::size_t left_out = 3;
        float highest = -2;
        for (std::size_t a = 0; a < 3; ++a) {
            const float b = offsets[(a + 1) % 3], c = offsets[(a + 2) % 3];
            const float score = std::abs(offsets[a]) - (crowd.sides[a] == 4 ? 1.0f : 0.0f);
            if (std::sqrt(b * b + c * c) / 2 > limit_ || score <= highest || is_opposite(crowd, a)) continue;
            left_out = a;
            highest = score;
        }
        if (left_out == 3) return;
        slice_.sides[crowd.word][crowd.sides[left_out]] &= ~bit_at(crowd.bit);
        gather(k);
        float half_way = 0;
        for (std::size_t a = 0; a < 3; ++a) {
            middle_[a][k] = offsets_[a][k] / 2;
            half_way += middle_[a][k] * middle_[a][k];
        }
        furthest_[k] = std::sqrt(half_way);
    }

    // Whether the sample at the other end of a point's edge has points on sides opposite to those of the
    // crowd's two others. Of the next slice it is not known yet.
    bool is_opposite(const Crowd& crowd, std::size_t axis) const {
        if (crowd.sides[axis] == 4) return false;
        const bool forward = crowd.sides[axis] % 2 == 0;
        std::int64_t word = crowd.word, bit = crowd.bit;
        if (axis == 0) bit += forward ? 1 : -1;
        if (axis == 1)
            word += forward ? static_cast<std::int64_t>(stride_) : -static_cast<std::int64_t>(stride_);
        const SnapSlice& slice = axis == 2 ? before_ : slice_;
        return has_point(slice, word, bit, crowd.sides[(axis + 1) % 3] ^ 1u) &&
               has_point(slice, word, bit, crowd.sides[(axis + 2) % 3] ^ 1u);
    }
    // Of a sample of the slice; `bit` may lie in a word beside. Edges towards the slice before are of that.
    bool has_point(const SnapSlice& slice, std::int64_t word, std::int64_t bit, std::uint32_t side) const {
        const std::size_t axis = side / 2;
        if (side == 1) --bit;
        if (side == 3) word -= static_cast<std::int64_t>(stride_);
        word += bit < 0 ? -1 : bit / 64;
        const WordEdges& edges = (side == 5 ? before_ : slice).edges[static_cast<std::size_t>(word)];
        const std::uint64_t own =
            side % 2 == 1 ? edges.second[axis] : edges.crossed[axis] & ~edges.second[axis];
        return own >> (bit & 63) & 1;
    }

    // Rule 4. Samples and those before them along an axis whose points are on sides opposite in both other
    // axes, with none on the edge between.
    static HWY_INLINE std::uint64_t opposite(std::size_t axis, const WordSides& before,
                                             const WordSides& here) {
        const std::size_t b = 2 * ((axis + 1) % 3), c = 2 * ((axis + 2) % 3);
        return ((here[b] & before[b + 1]) | (here[b + 1] & before[b])) &
               ((here[c] & before[c + 1]) | (here[c + 1] & before[c])) &
               ~(before[2 * axis] | here[2 * axis + 1]);
    }

    // Which of a word's crowds join; other near points move away.
    HWY_INLINE void decide(const CrowdedWord& word) {
        const WordSides &sides = slice_.sides[word.word], &before_x = slice_.sides[word.word - 1];
        WordSides sides_x;
        for (std::size_t k = 0; k < 6; ++k) sides_x[k] = shifted(sides[k], before_x[k]);
        const std::uint64_t apart =
            word.can & (opposite(0, sides_x, sides) | opposite(1, slice_.sides[word.word - stride_], sides) |
                        opposite(2, before_.sides[word.word], sides));
        Crowd* const crowds = crowds_ + word.first_crowd;
        for_each_bit(
            apart, [&](std::uint32_t bit) { crowds[popcount(word.can & (bit_at(bit) - 1))].joins = false; });
        std::uint64_t joining = 0, left = word.can;
        for (std::size_t k = 0; left != 0; ++k, left &= left - 1)
            joining |= left & (~left + 1) & (~std::uint64_t{crowds[k].joins} + 1);
        std::uint64_t away[6];
        for (std::size_t k = 0; k < 6; ++k) away[k] = word.near[k] & ~(sides[k] & joining);
        for_each_bit(any(away), [&](std::uint32_t bit) HWY_ATTR {
            std::uint32_t of_sample = 0;
            for (std::uint32_t k = 0; k < 6; ++k)
                of_sample |= static_cast<std::uint32_t>(away[k] >> bit & 1) << k;
            for_each_bit(of_sample, [&](std::uint32_t side) HWY_ATTR { move_away(word.word, bit, side); });
        });
    }

    // Rule 5. Moves a point to the limit's distance from its sample, on its edge.
    void move_away(std::size_t word, std::uint32_t bit, std::uint32_t side) {
        SnapSlice& slice = side == 5 ? before_ : slice_;
        const std::uint32_t at = place(*side_edges(word, side).edges, side, bit);
        const float step = (side % 2 == 0 ? limit_ : -limit_) - slice.offsets[at];
        moved_[slice.start + at] = std::abs(step);
        for (std::size_t r = 0; r < 3; ++r)
            slice.points[at][r] += input_.to_physical.matrix[r][side / 2] * step;
    }

    void become_one() {
        slice_.from_before.resize(count_ + 1);
        std::size_t from_before = 0;
        std::int64_t y = -1;
        Vec3f base{};
        for (std::size_t i = 0; i < word_count_; ++i) {
            const CrowdedWord& word = words_[i];
            if (word.y != y) base = input_.to_physical.row_base(word.y - bits_.pad, z_ - bits_.pad);
            y = word.y;
            const std::size_t end = i + 1 < word_count_ ? words_[i + 1].first_crowd : count_;
            for (std::size_t k = word.first_crowd; k < end; ++k) {
                const Crowd& crowd = crowds_[k];
                if (HWY_UNLIKELY(!crowd.joins)) continue;
                if (!slice_.normals.empty()) join_normals(crowd);
                for (const std::uint32_t p : crowd.points) {
                    one_[p] = crowd.one;
                    moved_[p] = furthest_[k];
                }
                slice_.from_before[from_before] = {crowd.points[2], crowd.one};
                from_before += crowd.points[2] < slice_.start;
                const auto x = static_cast<float>(word.first_x + static_cast<std::int32_t>(crowd.bit));
                const float step[3] = {x + middle_[0][k], middle_[1][k], middle_[2][k]};
                Vec3f& point = slice_.points[crowd.one - slice_.start];
                for (std::size_t r = 0; r < 3; ++r) {
                    const Vec3f& m = input_.to_physical.matrix[r];
                    point[r] = base[r] + (m[0] * step[0] + m[1] * step[1] + m[2] * step[2]);
                }
            }
        }
        slice_.from_before.resize(from_before);
    }

    void join_normals(const Crowd& crowd) {
        Vec3f normal{0, 0, 0};
        for (std::size_t a = 0; a < 3; ++a) {
            const std::uint32_t p = crowd.points[a];
            const SnapSlice& slice = p < slice_.start ? before_ : slice_;
            if ((slice_.sides[crowd.word][crowd.sides[a]] >> crowd.bit & 1) == 0) continue;
            for (std::size_t r = 0; r < 3; ++r) normal[r] += slice.normals[p - slice.start][r];
        }
        const float length = std::sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
        if (length > 0)
            slice_.normals[crowd.one - slice_.start] = {normal[0] / length, normal[1] / length,
                                                        normal[2] / length};
    }

    const EmitInput& input_;
    const InsideBits& bits_;
    const float limit_;
    const std::int64_t z_;
    SnapSlice& before_;
    SnapSlice& slice_;
    const std::size_t stride_;
    std::uint32_t* const one_;
    float* const moved_;
    const std::uint64_t* const no_words_;
    Crowd* const crowds_;
    CrowdedWord* const words_;
    float *const part_, *const furthest_, *offsets_[3], *middle_[3];  // as in Crowds
    std::size_t count_ = 0, word_count_ = 0;
};

void join_slice_target(const EmitInput& input, float limit, std::int64_t z, SnapSlice& before,
                       SnapSlice& slice, Crowds& crowds, std::uint32_t* one, float* moved) {
    SliceJoiner(input, limit, z, before, slice, crowds, one, moved).join();
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(join_slice_target);

void Crowds::make_room(const EmitInput& input, std::size_t points) {
    no_words.resize(input.active.masks_per_row);
    words.resize(static_cast<std::size_t>(input.bits.ny) * input.bits.words_per_row);
    if (points / 2 + kSlack <= crowds.size()) return;
    const std::size_t size = points / 2 + points / 8 + kSlack;
    resize_discarding(crowds, size);
    for (Buffer<float>* values :
         {&offsets[0], &offsets[1], &offsets[2], &part, &middle[0], &middle[1], &middle[2], &furthest})
        resize_discarding(*values, size);
}

void join_slice(const EmitInput& input, float limit, std::int64_t z, SnapSlice& before, SnapSlice& slice,
                Crowds& crowds, std::uint32_t* one, float* moved) {
    crowds.make_room(input, before.size + slice.size);
    HWY_DYNAMIC_DISPATCH(join_slice_target)(input, limit, z, before, slice, crowds, one, moved);
}

}  // namespace marrow::internal
#endif
