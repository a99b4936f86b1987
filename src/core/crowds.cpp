// Which points crowd round a sample is seen in bits, for 64 samples at a time; so is how they hang together.
// Two points of a sample are neighbours on the surface where their edges are perpendicular and the face
// between these has a line from one to the other: always if the sample is inside, for the face's lines cut
// off inside corners, and if it is outside where the face's fourth corner is inside. Three that are
// neighbours of each other are a triangle.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "crowds.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "crowds.h"
#include "row_bits-inl.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// A point's side of its sample: 2 * axis, and 1 more towards lower indices. Sets of them are bits.
using Sides = std::uint32_t;
constexpr std::uint32_t kSides = 6;

constexpr Sides perpendicular_to(std::uint32_t side) {
    return 0x3fu & ~(3u << (side & ~1u));
}

HWY_INLINE std::uint32_t popcount(std::uint64_t bits) {
    return static_cast<std::uint32_t>(__builtin_popcountll(bits));
}

template <class F>
HWY_INLINE void for_each_bit(std::uint64_t bits, const F& f) {
    for (; bits != 0; bits &= bits - 1) f(static_cast<std::uint32_t>(std::countr_zero(bits)));
}

// The edges that start at the 64 samples of a word, and their points, by axis.
struct WordEdges {
    std::uint64_t crossed[3], second[3], near[3];  // second: the point belongs to the edge's second end
    std::uint32_t first_point[3];
};
constexpr WordEdges kNoEdges{};

// The edges at the 64 samples of a word on one of their sides.
struct SideEdges {
    std::uint64_t crossed, belongs;  // belongs: the point is nearer to this end
    std::uint64_t near;
    std::uint32_t first_point;
    const float* offsets;  // of the slice in which the edges start
    std::uint32_t first_of_slice;

    std::uint32_t point(std::uint32_t bit) const {
        return first_point + popcount(crossed & ((std::uint64_t{1} << bit) - 1));
    }
    float offset(std::uint32_t point) const { return offsets[point - first_of_slice]; }
};

// The points that belong to one sample.
struct Round {
    Sides sides;
    std::array<std::uint32_t, kSides> points;
    std::array<float, kSides> offsets;
    std::array<Sides, kSides> neighbours;  // on the surface
    std::uint8_t faces;                    // of the box in which the sample lies

    // The sides that hang together with the lowest of `among`.
    Sides hanging_together(Sides among) const {
        Sides found = among & (~among + 1), before = 0;
        while (found != before) {
            before = found;
            for_each_bit(before, [&](std::uint32_t side) { found |= neighbours[side] & among; });
        }
        return found;
    }

    // Whether points that hang together leave one closed rim round them when they become one: whether they
    // and the triangles between them have no hole. At the surface's border, whether they meet it in one piece.
    bool may_join(Sides joining) const {
        std::uint32_t edges = 0, at_border = 0, border_edges = 0;
        for_each_bit(joining, [&](std::uint32_t side) {
            at_border += (faces & ~(1u << side / 2)) != 0;
            for_each_bit(neighbours[side] & joining & (~Sides{1} << side), [&](std::uint32_t other) {
                ++edges;
                border_edges += faces >> (3 - side / 2 - other / 2) & 1;
            });
        });
        if (at_border > 0 && border_edges + 1 != at_border) return false;
        const std::uint32_t count = popcount(joining);
        if (count <= 3) return true;
        std::uint32_t triangles = 0;
        for (std::uint32_t corner = 0; corner < 8; ++corner) {
            const std::uint32_t x = corner & 1, y = 2 + (corner >> 1 & 1), z = 4 + (corner >> 2);
            triangles += (joining >> x & joining >> y & joining >> z & neighbours[x] >> y &
                          neighbours[y] >> z & neighbours[z] >> x & 1);
        }
        return count + triangles == edges + 1;
    }
};

// How far a position is along an axis.
struct AxisMeter {
    Vec3f per_mm{};        // what that gains, in edges, with a step in mm
    float per_sample = 0;  // and with a step of a sample along x

    AxisMeter(const Frame& frame, std::size_t axis) {
        float squared = 0;
        for (const Vec3f& m : frame.matrix) squared += m[axis] * m[axis];
        for (std::size_t r = 0; r < 3; ++r) {
            per_mm[r] = frame.matrix[r][axis] / squared;
            per_sample += frame.matrix[r][0] * per_mm[r];
        }
    }
};

class CrowdFinder {
  public:
    CrowdFinder(const EmitInput& input, float limit, const Vec3f* points, std::vector<Crowd>& crowds)
        : input_(input),
          bits_(input.bits),
          limit_(limit),
          points_(points),
          crowds_(crowds),
          meters_{{input.frame, 0}, {input.frame, 1}, {input.frame, 2}},
          slice_words_(bits_.words_per_row * static_cast<std::size_t>(bits_.ny)),
          edges_(2 * slice_words_),
          offsets_{Buffer<float>(kAtOnce), Buffer<float>(kAtOnce)},
          no_words_(input.active.masks_per_row) {}

    // Looks at slices one after the other; the one before is kept.
    void look_at(std::int64_t z) {
        const std::uint64_t first = input_.points.first_output(bits_.row_index(0, z)),
                            end = input_.points.first_output(bits_.row_index(0, z + 1));
        first_point_[z & 1] = static_cast<std::uint32_t>(first);
        offsets_[z & 1].resize(end - first + kAtOnce);
        const Vec3f* point = points_ + first;
        float* offset = offsets_[z & 1].data();
        WordEdges* edges = edges_.data() + static_cast<std::size_t>(z & 1) * slice_words_;
        for (std::int64_t y = 0; y < bits_.ny; ++y, edges += bits_.words_per_row) {
            const std::size_t r = bits_.row_index(y, z);
            if (input_.points.leaves()[r] == 0) {
                for_each_active_word(input_.active, r, [&](std::size_t w) { edges[w] = kNoEdges; });
                continue;
            }
            const RowBits row(bits_, GridRow(bits_, r));
            const Vec3f base = input_.frame.row_base(y - bits_.pad, z - bits_.pad);
            const auto look_along = [&](std::size_t axis, const auto& crossed) HWY_ATTR {
                const AxisMeter meter = meters_[axis];
                for_each_active_word(input_.active, r, [&](std::size_t w) HWY_ATTR {
                    WordEdges& word = edges[w];
                    const std::uint64_t bits = crossed(w);
                    word.crossed[axis] = bits;
                    word.first_point[axis] = static_cast<std::uint32_t>(point - points_);
                    const auto first_x =
                        static_cast<std::int32_t>(64 * static_cast<std::int64_t>(w) - bits_.first_x);
                    measure(meter, base, first_x, bits, point, offset, word.second[axis], word.near[axis]);
                    const std::uint32_t count = popcount(bits);
                    point += count;
                    offset += count;
                });
            };
            look_along(0, [&](std::size_t w) HWY_ATTR { return row.crossed_x(kRow, w); });
            look_along(1, [&](std::size_t w) HWY_ATTR { return row.crossed_y(w); });
            look_along(2, [&](std::size_t w) HWY_ATTR { return row.crossed_z(w); });
        }
    }

    // Of a slice that was looked at, and the one before it, if any.
    void find_in(std::int64_t z) {
        for (std::int64_t y = 0; y < bits_.ny; ++y) find_in_row(y, z);
    }

  private:
    static constexpr std::uint32_t kAtOnce = 4;

    // Most words have few points along an axis. So many are measured without asking, and what was too much is
    // overwritten; their bits are 0.
    HWY_INLINE void measure(const AxisMeter& meter, const Vec3f& base, std::int32_t first_x,
                            std::uint64_t crossed, const Vec3f* point, float* offset, std::uint64_t& second,
                            std::uint64_t& near) {
        const hn::CappedTag<float, kAtOnce> d;
        const hn::RebindToSigned<decltype(d)> di;
        using V = hn::Vec<decltype(d)>;
        const Vec3f* const end = points_ + input_.points.total();
        second = near = 0;
        for (std::uint64_t left = crossed; left != 0; point += kAtOnce, offset += kAtOnce) {
            HWY_ALIGN std::int32_t x[kAtOnce];
            std::uint64_t bit[kAtOnce];
            for (std::uint32_t k = 0; k < kAtOnce; ++k) {
                x[k] = first_x + std::countr_zero(left);
                bit[k] = left & (~left + 1);
                left &= left - 1;
            }
            Vec3f copied[kAtOnce] = {};
            const Vec3f* from = point;
            if (HWY_UNLIKELY(end - point < kAtOnce)) from = (std::copy(point, end, copied), copied);
            for (std::size_t i = 0; i < kAtOnce; i += hn::Lanes(d)) {
                V at[3];
                hn::LoadInterleaved3(d, from[i].data(), at[0], at[1], at[2]);
                V fraction = hn::Mul(hn::Set(d, -meter.per_sample), hn::ConvertTo(d, hn::Load(di, x + i)));
                for (std::size_t r = 0; r < 3; ++r) {
                    fraction = hn::Add(
                        fraction, hn::Mul(hn::Sub(at[r], hn::Set(d, base[r])), hn::Set(d, meter.per_mm[r])));
                }
                const V one = hn::Set(d, 1.0f);
                fraction =  // also where it is NaN
                    hn::IfThenElseZero(hn::Gt(fraction, hn::Zero(d)), hn::Min(fraction, one));
                const auto is_second = hn::Gt(fraction, hn::Set(d, 0.5f));
                const V offsets = hn::IfThenElse(is_second, hn::Neg(hn::Sub(one, fraction)), fraction);
                hn::StoreU(offsets, d, offset + i);
                std::uint64_t second_bits = 0, near_bits = 0;
                hn::StoreMaskBits(d, is_second, reinterpret_cast<std::uint8_t*>(&second_bits));
                hn::StoreMaskBits(d, hn::Le(hn::Abs(offsets), hn::Set(d, limit_)),
                                  reinterpret_cast<std::uint8_t*>(&near_bits));
                for (std::size_t k = 0; k < hn::Lanes(d); ++k) {
                    second |= bit[i + k] & (~(second_bits >> k & 1) + 1);
                    near |= bit[i + k] & (~(near_bits >> k & 1) + 1);
                }
            }
        }
    }

    // A row's edges, as far as its words are active.
    struct RowEdges {
        const WordEdges* words;
        const std::uint64_t* active;

        const WordEdges& operator[](std::size_t w) const {
            return active[w / 64] >> w % 64 & 1 ? words[w] : kNoEdges;
        }
    };
    RowEdges row_edges(std::int64_t y, std::int64_t z) const {
        if (y < 0 || z < 0) return {nullptr, no_words_.data()};
        return {edges_.data() + static_cast<std::size_t>(z & 1) * slice_words_ +
                    static_cast<std::size_t>(y) * bits_.words_per_row,
                input_.active.row(bits_.row_index(y, z))};
    }

    void find_in_row(std::int64_t y, std::int64_t z) {
        const RowEdges here = row_edges(y, z), before_y = row_edges(y - 1, z), before_z = row_edges(y, z - 1);
        std::uint64_t carry = 0;
        for (std::size_t m = 0; m < input_.active.masks_per_row; ++m) {
            const std::uint64_t active = here.active[m];
            const std::uint64_t words =
                active | active << 1 | carry | before_y.active[m] | before_z.active[m];
            carry = active >> 63;
            for_each_bit(words, [&](std::uint32_t bit) HWY_ATTR {
                const std::size_t w = 64 * m + bit;
                if (w >= bits_.words_per_row) return;
                find_in_word(w, y, z, here[w], w > 0 ? here[w - 1] : kNoEdges, before_y[w], before_z[w]);
            });
        }
    }

    using Sides6 = std::array<SideEdges, kSides>;

    HWY_INLINE void find_in_word(std::size_t w, std::int64_t y, std::int64_t z, const WordEdges& here,
                                 const WordEdges& before_x, const WordEdges& before_y,
                                 const WordEdges& before_z) {
        const std::uint32_t this_first = first_point_[z & 1], before_first = first_point_[~z & 1];
        const float *this_slice = offsets_[z & 1].data(), *slice_before = offsets_[~z & 1].data();
        const auto starting = [&](std::size_t axis) -> SideEdges {
            return {here.crossed[axis], here.crossed[axis] & ~here.second[axis],
                    here.near[axis],    here.first_point[axis],
                    this_slice,         this_first};
        };
        const auto ending = [](const WordEdges& before, std::size_t axis, const float* offsets,
                               std::uint32_t first) -> SideEdges {
            return {before.crossed[axis],
                    before.second[axis],
                    before.near[axis],
                    before.first_point[axis],
                    offsets,
                    first};
        };
        const auto shifted = [](std::uint64_t bits, std::uint64_t before) {
            return bits << 1 | before >> 63;
        };
        const auto last_of = [](const WordEdges& e) { return e.first_point[0] + popcount(e.crossed[0]) - 1; };
        const SideEdges ending_x{shifted(here.crossed[0], before_x.crossed[0]),
                                 shifted(here.second[0], before_x.second[0]),
                                 shifted(here.near[0], before_x.near[0]),
                                 before_x.crossed[0] >> 63 ? last_of(before_x) : here.first_point[0],
                                 this_slice,
                                 this_first};
        const Sides6 edges{starting(0), ending_x,
                           starting(1), ending(before_y, 1, this_slice, this_first),
                           starting(2), ending(before_z, 2, slice_before, before_first)};
        std::uint64_t one = 0, two = 0, near = 0, opposite = 0;
        for (const SideEdges& e : edges) {
            two |= one & e.belongs;
            one |= e.belongs;
            near |= e.near & e.belongs;
        }
        const std::uint64_t crowded = two & near;
        if (crowded == 0) return;
        for (std::size_t side = 0; side < kSides; side += 2)
            opposite |= edges[side].belongs & edges[side + 1].belongs;
        const std::uint64_t apart = separated(w, y, z, edges), plain = crowded & ~opposite & ~apart;
        for_each_bit(crowded, [&](std::uint32_t bit) HWY_ATTR {
            const std::array<std::int64_t, 3> sample{static_cast<std::int64_t>(64 * w + bit), y, z};
            if ((plain >> bit & 1) == 0 || !add_plain(edges, bit, faces_of_sample(sample)))
                find_round(edges, bit, sample, (apart >> bit & 1) != 0);
        });
    }

    // The outside samples of a word with two points that belong to them on perpendicular edges but are no
    // neighbours.
    HWY_INLINE std::uint64_t separated(std::size_t w, std::int64_t y, std::int64_t z,
                                       const Sides6& edges) const {
        const auto row = [&](std::int64_t at_y, std::int64_t at_z) {  // where the grid ends, any row does
            return bits_.row(bits_.row_index(std::clamp<std::int64_t>(at_y, 0, bits_.ny - 1),
                                             std::clamp<std::int64_t>(at_z, 0, bits_.nz - 1)));
        };
        const auto next_x = [&](const std::uint64_t* r) {
            return r[w] >> 1 | (w + 1 < bits_.words_per_row ? r[w + 1] << 63 : 0);
        };
        const auto before_x = [&](const std::uint64_t* r) {
            return r[w] << 1 | (w > 0 ? r[w - 1] >> 63 : 0);
        };
        const auto both = [&](std::size_t a, std::size_t b) { return edges[a].belongs & edges[b].belongs; };
        std::uint64_t result = 0;
        for (std::uint32_t up = 0; up < 2; ++up) {
            const std::int64_t step = up == 0 ? 1 : -1;
            const std::uint64_t *in_y = row(y + step, z), *in_z = row(y, z + step);
            result |= (both(0, 2 + up) & ~next_x(in_y)) | (both(1, 2 + up) & ~before_x(in_y)) |
                      (both(0, 4 + up) & ~next_x(in_z)) | (both(1, 4 + up) & ~before_x(in_z)) |
                      (both(2, 4 + up) & ~row(y + 1, z + step)[w]) |
                      (both(3, 4 + up) & ~row(y - 1, z + step)[w]);
        }
        return result & ~row(y, z)[w];
    }

    std::uint8_t faces_of_sample(const std::array<std::int64_t, 3>& sample) const {
        std::uint32_t faces = 0;
        for (std::size_t a = 0; a < 3; ++a) {
            const bool in_face = sample[a] == 0 || sample[a] + 1 == input_.volume.geometry.dims[a];
            faces |= static_cast<std::uint32_t>(in_face) << a;
        }
        return static_cast<std::uint8_t>(bits_.pad == 0 ? faces : 0);
    }

    // The crowd of a sample with at most one point along each axis, all neighbours of each other, if these all
    // become one in their mean: without branches, most are such.
    HWY_INLINE bool add_plain(const Sides6& edges, std::uint32_t bit, std::uint8_t faces) {
        if (faces != 0) return false;
        std::uint32_t points[3], present[3];
        float offsets[3];
        for (std::uint32_t a = 0; a < 3; ++a) {
            const auto backward = static_cast<std::uint32_t>(edges[2 * a + 1].belongs >> bit & 1);
            const SideEdges& side = edges[2 * a + backward];
            present[a] = static_cast<std::uint32_t>(side.belongs >> bit & 1);
            points[a] = side.point(bit);
            const float offset = side.offsets[present[a] != 0 ? points[a] - side.first_of_slice : 0];
            offsets[a] = present[a] != 0 ? offset : 0;
        }
        constexpr float kPart[] = {0, 1, 1.0f / 2, 1.0f / 3};
        const std::uint32_t size = present[0] + present[1] + present[2];
        const float part = kPart[size];
        const Vec3f middle{part * offsets[0], part * offsets[1], part * offsets[2]};
        const float squared = middle[0] * middle[0] + middle[1] * middle[1] + middle[2] * middle[2];
        float furthest = 0;
        for (std::uint32_t a = 0; a < 3; ++a) {
            const float along = offsets[a] - middle[a];
            const float far = squared - middle[a] * middle[a] + along * along;
            furthest = std::max(furthest, present[a] != 0 ? far : 0);
        }
        furthest = std::sqrt(furthest);
        if (furthest > limit_) return false;
        Crowd& crowd = crowds_.emplace_back();
        std::uint32_t k = 0;
        for (std::uint8_t a = 0; a < 3; ++a) {
            crowd.points[k] = points[a];
            crowd.offsets[k] = offsets[a];
            crowd.axes[k] = a;
            k += present[a];
        }
        crowd.size = crowd.joining = static_cast<std::uint8_t>(size);
        crowd.faces = 0;
        crowd.moved = furthest;
        crowd.middle = middle;
        return true;
    }

    bool is_inside(std::int64_t bit, std::int64_t y, std::int64_t z) const {
        return bits_.row(bits_.row_index(y, z))[bit / 64] >> bit % 64 & 1;
    }

    // The crowds round the sample at (bit, y, z) of the grid.
    void find_round(const Sides6& edges, std::uint32_t bit, const std::array<std::int64_t, 3>& sample,
                    bool apart) {
        Round round;
        round.sides = 0;
        for (std::uint32_t side = 0; side < kSides; ++side) {
            if ((edges[side].belongs >> bit & 1) == 0) continue;
            round.sides |= 1u << side;
            round.points[side] = edges[side].point(bit);
            round.offsets[side] = edges[side].offset(round.points[side]);
        }
        round.faces = faces_of_sample(sample);
        for_each_bit(round.sides, [&](std::uint32_t side) HWY_ATTR {
            round.neighbours[side] = round.sides & perpendicular_to(side);
            if (!apart) return;
            for_each_bit(round.neighbours[side], [&](std::uint32_t other) HWY_ATTR {
                std::array<std::int64_t, 3> corner = sample;
                corner[side / 2] += side & 1 ? -1 : 1;
                corner[other / 2] += other & 1 ? -1 : 1;
                if (!is_inside(corner[0], corner[1], corner[2])) round.neighbours[side] &= ~(1u << other);
            });
        });
        for (Sides left = round.sides; left != 0;) {
            const Sides together = round.hanging_together(left);
            left &= ~together;
            float nearest = 1;
            for_each_bit(together, [&](std::uint32_t side) HWY_ATTR {
                nearest = std::min(nearest, std::abs(round.offsets[side]));
            });
            if ((together & (together - 1)) != 0 && nearest <= limit_) add(round, together);
        }
    }

    static std::uint8_t faces_of(const Round& round, Sides sides) {
        std::uint32_t faces = 0;
        for_each_bit(sides, [&](std::uint32_t side) { faces |= round.faces & ~(1u << side / 2); });
        return static_cast<std::uint8_t>(faces);
    }

    // A place from which none of the points is further than the limit, after leaving out those that are too
    // far from the others; from the sample, in edges. It is the points' mean, or if that is too far, nearer
    // to the middle of the smallest ball that holds them (Badoiu and Clarkson 2003). Where points lie in
    // faces of the volume's box, it does too.
    Vec3f find_middle(const Round& round, Sides& sides, float& furthest) const {
        const float most = limit_ * limit_;
        for (;;) {
            Vec3f middle{0, 0, 0};
            for_each_bit(sides, [&](std::uint32_t side) { middle[side / 2] += round.offsets[side]; });
            const auto count = static_cast<float>(popcount(sides));
            for (float& m : middle) m /= count;
            const std::uint32_t faces = round.faces == 0 ? 0 : faces_of(round, sides);
            std::uint32_t last = 0;
            for (float step = 2; step < 10; ++step) {
                for (unsigned a = 0; a < 3; ++a) middle[a] = faces >> a & 1 ? 0 : middle[a];
                const float squared = middle[0] * middle[0] + middle[1] * middle[1] + middle[2] * middle[2];
                float far = -1;
                for_each_bit(sides, [&](std::uint32_t side) {
                    const float across = middle[side / 2], along = round.offsets[side] - across;
                    const float distance = squared - across * across + along * along;
                    last = distance > far ? side : last;
                    far = std::max(distance, far);
                });
                if (far <= most) {
                    furthest = std::sqrt(std::max(far, 0.0f));
                    return middle;
                }
                for (std::uint32_t a = 0; a < 3; ++a)
                    middle[a] += ((a == last / 2 ? round.offsets[last] : 0) - middle[a]) / step;
            }
            sides &= ~(1u << last);
        }
    }

    void add(const Round& round, Sides together) {
        Sides joining = together;
        float furthest = 0;
        const Vec3f middle = find_middle(round, joining, furthest);
        if ((joining & (joining - 1)) == 0 || round.hanging_together(joining) != joining ||
            !round.may_join(joining))
            joining = 0;
        Crowd& crowd = crowds_.emplace_back();
        crowd.size = 0;
        const auto append = [&](std::uint32_t side) {
            crowd.points[crowd.size] = round.points[side];
            crowd.offsets[crowd.size] = round.offsets[side];
            crowd.axes[crowd.size++] = static_cast<std::uint8_t>(side / 2);
        };
        for_each_bit(joining, append);
        crowd.joining = crowd.size;
        for_each_bit(together & ~joining, append);
        crowd.faces = faces_of(round, joining);
        crowd.moved = furthest;
        crowd.middle = middle;
    }

    const EmitInput& input_;
    const InsideBits& bits_;
    const float limit_;
    const Vec3f* const points_;
    std::vector<Crowd>& crowds_;
    const AxisMeter meters_[3];
    const std::size_t slice_words_;
    Buffer<WordEdges> edges_;   // of even and odd slices; those of words that are not active mean nothing
    Buffer<float> offsets_[2];  // of the points of even and odd slices
    std::uint32_t first_point_[2] = {};
    const std::vector<std::uint64_t> no_words_;
};

void find_crowds_target(const EmitInput& input, float limit, const Vec3f* points, std::size_t begin,
                        std::size_t end, std::vector<Crowd>& crowds, std::vector<std::size_t>& slice_ends) {
    if (input.points.total() == 0) return slice_ends.resize(end - begin, 0);
    CrowdFinder finder(input, limit, points, crowds);
    if (begin > 0) finder.look_at(static_cast<std::int64_t>(begin) - 1);
    for (std::size_t z = begin; z < end; ++z) {
        finder.look_at(static_cast<std::int64_t>(z));
        finder.find_in(static_cast<std::int64_t>(z));
        slice_ends.push_back(crowds.size());
    }
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(find_crowds_target);

void find_crowds(const EmitInput& input, float limit, const Vec3f* points, std::size_t begin, std::size_t end,
                 std::vector<Crowd>& crowds, std::vector<std::size_t>& slice_ends) {
    HWY_DYNAMIC_DISPATCH(find_crowds_target)(input, limit, points, begin, end, crowds, slice_ends);
}

}  // namespace marrow::internal
#endif
