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

    std::uint32_t point(std::size_t axis, std::uint32_t bit) const {
        return first_point[axis] + popcount(crossed[axis] & ((std::uint64_t{1} << bit) - 1));
    }
};
constexpr WordEdges kNoEdges{};

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

class CrowdFinder {
  public:
    CrowdFinder(const EmitInput& input, float limit, const float* offsets, std::vector<Crowd>& crowds)
        : input_(input),
          bits_(input.bits),
          limit_(limit),
          offsets_(offsets),
          crowds_(crowds),
          slice_words_(bits_.words_per_row * static_cast<std::size_t>(bits_.ny)),
          edges_(2 * slice_words_),
          no_words_(input.active.masks_per_row) {}

    // Looks at slices one after the other; the first of them is there for the next.
    void look_at(std::int64_t z) {
        WordEdges* edges = edges_of_slice(z);
        auto point = static_cast<std::uint32_t>(input_.points.first_output(bits_.row_index(0, z)));
        for (std::int64_t y = 0; y < bits_.ny; ++y, edges += bits_.words_per_row) {
            const std::size_t r = bits_.row_index(y, z);
            const RowBits row(bits_, r);
            look_along(0, r, edges, point, [&](std::size_t w) HWY_ATTR { return row.crossed_x(kRow, w); });
            look_along(1, r, edges, point, [&](std::size_t w) HWY_ATTR { return row.crossed_y(w); });
            look_along(2, r, edges, point, [&](std::size_t w) HWY_ATTR { return row.crossed_z(w); });
        }
    }

    // Of a slice that was looked at, and the one before it, if any.
    void find_in(std::int64_t z) {
        for (std::int64_t y = 0; y < bits_.ny; ++y) find_in_row(y, z);
    }

  private:
    WordEdges* edges_of_slice(std::int64_t z) {
        return edges_.data() + static_cast<std::size_t>(z & 1) * slice_words_;
    }

    template <class Words>
    HWY_INLINE void look_along(std::size_t axis, std::size_t row, WordEdges* edges, std::uint32_t& point,
                               const Words& crossed) {
        for_each_active_word(input_.active, row, [&](std::size_t w) HWY_ATTR {
            WordEdges& word = edges[w];
            const std::uint64_t points = crossed(w);
            word.crossed[axis] = points;
            word.first_point[axis] = point;
            std::uint64_t second = 0, near = 0;
            for (std::uint64_t left = points; left != 0; left &= left - 1) {
                const float offset = offsets_[point++];
                const std::uint64_t lowest = left & (~left + 1);
                second |= std::signbit(offset) ? lowest : 0;
                near |= std::abs(offset) <= limit_ ? lowest : 0;
            }
            word.second[axis] = second;
            word.near[axis] = near;
        });
    }

    // A row's edges, as far as its words are active.
    struct RowEdges {
        const WordEdges* words;
        const std::uint64_t* active;

        const WordEdges& operator[](std::size_t w) const {
            return active[w / 64] >> w % 64 & 1 ? words[w] : kNoEdges;
        }
    };
    RowEdges row_edges(std::int64_t y, std::int64_t z) {
        if (y < 0 || z < 0) return {nullptr, no_words_.data()};
        return {edges_of_slice(z) + static_cast<std::size_t>(y) * bits_.words_per_row,
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
                const WordEdges& before_x = w > 0 ? here[w - 1] : kNoEdges;
                find_in_word(w, y, z, here[w], before_x, before_y[w], before_z[w]);
            });
        }
    }

    HWY_INLINE void find_in_word(std::size_t w, std::int64_t y, std::int64_t z, const WordEdges& here,
                                 const WordEdges& before_x, const WordEdges& before_y,
                                 const WordEdges& before_z) {
        const auto towards = [](const WordEdges& e, std::size_t axis) {
            return e.crossed[axis] & ~e.second[axis];
        };
        const std::uint64_t belongs[kSides] = {
            towards(here, 0), here.second[0] << 1 | before_x.second[0] >> 63,
            towards(here, 1), before_y.second[1],
            towards(here, 2), before_z.second[2]};
        std::uint64_t near =
            (here.near[0] & here.second[0]) << 1 | (before_x.near[0] & before_x.second[0]) >> 63 |
            (before_y.near[1] & before_y.second[1]) | (before_z.near[2] & before_z.second[2]);
        for (std::size_t axis = 0; axis < 3; ++axis) near |= here.near[axis] & belongs[2 * axis];
        std::uint64_t one = 0, two = 0;
        for (const std::uint64_t b : belongs) {
            two |= one & b;
            one |= b;
        }
        for_each_bit(two & near, [&](std::uint32_t bit) HWY_ATTR {
            Round round;
            round.sides = 0;
            for (std::uint32_t side = 0; side < kSides; ++side)
                round.sides |= static_cast<Sides>(belongs[side] >> bit & 1) << side;
            for_each_bit(round.sides, [&](std::uint32_t side) HWY_ATTR {
                std::uint32_t point = 0;
                switch (side) {
                    case 1:
                        point = bit > 0 ? here.point(0, bit - 1) : before_x.point(0, 63);
                        break;
                    case 3:
                        point = before_y.point(1, bit);
                        break;
                    case 5:
                        point = before_z.point(2, bit);
                        break;
                    default:
                        point = here.point(side / 2, bit);
                }
                round.points[side] = point;
                round.offsets[side] = offsets_[point];
            });
            find_round({static_cast<std::int64_t>(64 * w + bit), y, z}, round);
        });
    }

    bool is_inside(std::int64_t bit, std::int64_t y, std::int64_t z) const {
        return bits_.row(bits_.row_index(y, z))[bit / 64] >> bit % 64 & 1;
    }

    // The crowds round the sample at (bit, y, z) of the grid.
    void find_round(const std::array<std::int64_t, 3>& sample, Round& round) {
        const bool inside = is_inside(sample[0], sample[1], sample[2]);
        for_each_bit(round.sides, [&](std::uint32_t side) HWY_ATTR {
            round.neighbours[side] = round.sides & perpendicular_to(side);
            if (inside) return;
            for_each_bit(round.neighbours[side], [&](std::uint32_t other) HWY_ATTR {
                std::array<std::int64_t, 3> corner = sample;
                corner[side / 2] += side & 1 ? -1 : 1;
                corner[other / 2] += other & 1 ? -1 : 1;
                if (!is_inside(corner[0], corner[1], corner[2])) round.neighbours[side] &= ~(1u << other);
            });
        });
        round.faces = 0;
        if (bits_.pad == 0) {
            for (std::size_t a = 0; a < 3; ++a) {
                const bool in_face = sample[a] == 0 || sample[a] + 1 == input_.volume.geometry.dims[a];
                round.faces |= static_cast<std::uint8_t>(in_face << a);
            }
        }
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

    static Vec3f place(const Round& round, std::uint32_t side) {
        Vec3f at{0, 0, 0};
        at[side / 2] = round.offsets[side];
        return at;
    }

    static float distance(const Vec3f& a, const Vec3f& b) {
        const float x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
        return std::sqrt(x * x + y * y + z * z);
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
        for (;;) {
            Vec3f middle{0, 0, 0};
            for_each_bit(sides, [&](std::uint32_t side) { middle[side / 2] += round.offsets[side]; });
            const auto count = static_cast<float>(popcount(sides));
            for (float& m : middle) m /= count;
            const std::uint8_t faces = faces_of(round, sides);
            std::uint32_t last = 0;
            for (float step = 2; step < 10; ++step) {
                for (unsigned a = 0; a < 3; ++a) {
                    if (faces >> a & 1) middle[a] = 0;
                }
                furthest = -1;
                for_each_bit(sides, [&](std::uint32_t side) HWY_ATTR {
                    const float far = distance(middle, place(round, side));
                    if (far > furthest) furthest = far, last = side;
                });
                if (furthest <= limit_) return middle;
                const Vec3f to = place(round, last);
                for (std::size_t a = 0; a < 3; ++a) middle[a] += (to[a] - middle[a]) / step;
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
            crowd.axes[crowd.size++] = static_cast<std::uint8_t>(side / 2);
        };
        for_each_bit(joining, append);
        crowd.joining = crowd.size;
        for_each_bit(together & ~joining, append);
        crowd.faces = faces_of(round, joining);
        crowd.moved = furthest;
        crowd.step = middle;
        if (joining != 0) crowd.step[crowd.axes[0]] -= offsets_[crowd.points[0]];
    }

    const EmitInput& input_;
    const InsideBits& bits_;
    const float limit_;
    const float* const offsets_;
    std::vector<Crowd>& crowds_;
    const std::size_t slice_words_;
    Buffer<WordEdges> edges_;  // of even and odd slices; those of words that are not active mean nothing
    const std::vector<std::uint64_t> no_words_;
};

void find_crowds_target(const EmitInput& input, float limit, const float* offsets, std::size_t begin,
                        std::size_t end, std::vector<Crowd>& crowds, std::vector<std::size_t>& slice_ends) {
    CrowdFinder finder(input, limit, offsets, crowds);
    if (begin > 0) finder.look_at(static_cast<std::int64_t>(begin) - 1);
    for (std::size_t z = begin; z < end; ++z) {
        finder.look_at(static_cast<std::int64_t>(z));
        finder.find_in(static_cast<std::int64_t>(z));
        slice_ends.push_back(crowds.size());
    }
}

// Of the points on the edges along an axis that start in a row, in their order; returns the end of these.
template <class Words>
HWY_INLINE float* measure_along(const EmitInput& input, std::size_t axis, std::size_t row,
                                const Vec3f*& point, float* HWY_RESTRICT out, const Words& crossed) {
    const InsideBits& bits = input.bits;
    const Vec3f base = input.frame.row_base(static_cast<std::int64_t>(row) % bits.ny - bits.pad,
                                            static_cast<std::int64_t>(row) / bits.ny - bits.pad);
    Vec3f per_edge;  // the scalar product with it is in edges
    float squared = 0;
    for (std::size_t r = 0; r < 3; ++r) squared += input.frame.matrix[r][axis] * input.frame.matrix[r][axis];
    for (std::size_t r = 0; r < 3; ++r) per_edge[r] = input.frame.matrix[r][axis] / squared;
    for_each_active_word(input.active, row, [&](std::size_t w) HWY_ATTR {
        const std::int64_t first_x = static_cast<std::int64_t>(64 * w) - bits.first_x;
        for (std::uint64_t set = crossed(w); set != 0; set &= set - 1) {
            const auto x = static_cast<float>(first_x + std::countr_zero(set));
            const Vec3f first = input.frame.point(base, x, axis, 0);
            const Vec3f& at = *point++;
            float fraction = 0;
            for (std::size_t r = 0; r < 3; ++r) fraction += (at[r] - first[r]) * per_edge[r];
            fraction = fraction > 0 ? std::min(fraction, 1.0f) : 0;  // also where it is NaN
            *out++ = fraction <= 0.5f ? fraction : -(1 - fraction);
        }
    });
    return out;
}

void measure_offsets_target(const EmitInput& input, std::size_t row_begin, std::size_t row_end,
                            const Vec3f* points, float* out) {
    for (std::size_t r = row_begin; r < row_end; ++r) {
        if (input.points.leaves()[r] == 0) continue;
        const RowBits row(input.bits, r);
        out = measure_along(input, 0, r, points, out,
                            [&](std::size_t w) HWY_ATTR { return row.crossed_x(kRow, w); });
        out =
            measure_along(input, 1, r, points, out, [&](std::size_t w) HWY_ATTR { return row.crossed_y(w); });
        out =
            measure_along(input, 2, r, points, out, [&](std::size_t w) HWY_ATTR { return row.crossed_z(w); });
    }
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(find_crowds_target);
HWY_EXPORT(measure_offsets_target);

void find_crowds(const EmitInput& input, float limit, const float* offsets, std::size_t begin,
                 std::size_t end, std::vector<Crowd>& crowds, std::vector<std::size_t>& slice_ends) {
    HWY_DYNAMIC_DISPATCH(find_crowds_target)(input, limit, offsets, begin, end, crowds, slice_ends);
}

void measure_offsets(const EmitInput& input, std::size_t row_begin, std::size_t row_end, const Vec3f* points,
                     float* offsets) noexcept {
    const std::uint64_t first = input.points.first_output(row_begin);
    HWY_DYNAMIC_DISPATCH(measure_offsets_target)(input, row_begin, row_end, points + first, offsets + first);
}

}  // namespace marrow::internal
#endif
