#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/surface_nets/emit_quads.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cstring>

#include "writers.h"

// The patch of a crossed grid edge: a quad between the points of the four cells round it, which the labels at both ends have.
// Where a face between two of the cells has two knots, that of the edge is a corner more.
#ifndef MARROW_LABEL_PATCHES_TYPES  // once for all targets
#define MARROW_LABEL_PATCHES_TYPES
namespace marrow::internal {

// Whether the diagonal between the first and third of four points is not longer than the other.
inline bool first_diagonal_is_shorter(const NetPoint& a, const NetPoint& b, const NetPoint& c,
                                      const NetPoint& d) {
    using Four = float __attribute__((vector_size(16)));
    const auto vector = [](const NetPoint& p) {
        Four four;
        std::memcpy(&four, p.at, sizeof four);
        return four;
    };
    const Four first = vector(a) - vector(c), second = vector(b) - vector(d);
    const Four difference = first * first - second * second;
    return difference[0] + difference[1] + difference[2] <= 0;
}

// The corners of a patch, counter-clockwise seen from its edge's upper end, and the first again. The edge begins at corner 0 of
// the third one's cell.
struct alignas(32) Patch {
    std::array<std::uint32_t, 5> corners;
    std::uint32_t axis;  // of the edge
};

// By axis: the other two.
constexpr std::array<std::array<std::size_t, 2>, 3> kAcross = {{{1, 2}, {2, 0}, {0, 1}}};

// By axis: below the bit that an edge is to each cell round it.
constexpr std::array<std::array<std::uint32_t, 4>, 3> kEdgesBefore = [] {
    constexpr int kRing[4][2] = {{-1, -1}, {0, -1}, {0, 0}, {-1, 0}};
    std::array<std::array<std::uint32_t, 4>, 3> before{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto [u, v] = kAcross[axis];
        for (std::size_t c = 0; c < 4; ++c) {
            const int corner = (kRing[c][0] < 0 ? 1 << u : 0) | (kRing[c][1] < 0 ? 1 << v : 0);
            before[axis][c] = (1u << edge_between(corner, corner | 1 << axis)) - 1;
        }
    }
    return before;
}();

}  // namespace marrow::internal
#endif

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

// Makes the patches of a piece's edges. They wait until some hundreds are together: their number varies from word to word of
// the bits, and each short loop's end would be mispredicted.
class Patches {
  public:
    Patches(const LabelNet& net, bool mirrored, TriangleWriter* writers)
        : net_(net), corners_(net.corners.data()), mirrored_(mirrored), writers_(writers) {}

    void make_row(std::int64_t j, std::int64_t k) {
        const BorderBits& bits = net_.bits;
        // Rows of cells round the row of samples; where there is none, no edge that it is beside is crossed.
        const std::int64_t lower_j = std::max<std::int64_t>(j - 1, 0),
                           lower_k = std::max<std::int64_t>(k - 1, 0);
        const CellRow rows[4] = {CellRow(bits, lower_j, lower_k), CellRow(bits, j, lower_k),
                                 CellRow(bits, lower_j, k), CellRow(bits, j, k)};
        std::uint64_t carry_y = 0, carry_z = 0;  // whether the cells before the word are complex
        const std::size_t row = bits.row(j, k);
        for (std::size_t w = 0; w < bits.words; ++w) {
            const std::uint64_t crossed[3] = {bits.crossed[0][row + w], bits.crossed[1][row + w],
                                              bits.crossed[2][row + w]};
            const std::uint64_t here = rows[3].complex[w], below_y = here | rows[1].complex[w],
                                below_z = here | rows[2].complex[w];
            if ((crossed[0] | crossed[1] | crossed[2]) != 0) {
                const CellWord words[4] = {CellWord(rows[0], w), CellWord(rows[1], w), CellWord(rows[2], w),
                                           CellWord(rows[3], w)};
                add<0>(crossed[0], below_y | below_z | rows[0].complex[w], [&](std::uint64_t below) {
                    return Corners{words[0].id(below), words[1].id(below), words[3].id(below),
                                   words[2].id(below)};
                });
                add<1>(crossed[1], below_y | below_y << 1 | carry_y, [&](std::uint64_t below) {
                    const std::uint32_t lower = words[1].id(below), upper = words[3].id(below);
                    return Corners{lower - 1, upper - 1, upper, lower};
                });
                add<2>(crossed[2], below_z | below_z << 1 | carry_z, [&](std::uint64_t below) {
                    const std::uint32_t lower = words[2].id(below), upper = words[3].id(below);
                    return Corners{lower - 1, lower, upper, upper - 1};
                });
            }
            carry_y = below_y >> 63;
            carry_z = below_z >> 63;
        }
    }

    // Makes those that wait.
    void flush() {
        for (std::size_t n = 0; n < size_[1]; ++n) resolve(waiting_[1][n]);
        for (std::size_t n = 0; n < size_[0]; ++n) make(waiting_[0][n]);
        size_ = {};
    }

  private:
    static constexpr std::size_t kRoom = 256;

    // `cells` gives the cells round an edge by the bits below its own.
    template <std::uint32_t kAxis, class Cells>
    HWY_INLINE void add(std::uint64_t crossed, std::uint64_t complex, const Cells& cells) {
        if (size_[0] + size_[1] + 64 > kRoom) flush();
        for (std::uint64_t left = crossed; left != 0; left &= left - 1) {
            const std::uint64_t bit = left & -left;
            put((complex & bit) != 0 ? 1 : 0, cells(bit - 1), kAxis);
        }
    }
    HWY_INLINE void put(std::size_t complex, Corners cells, std::uint32_t axis) {
        Patch& patch = waiting_[complex][size_[complex]++];
        std::memcpy(patch.corners.data(), &cells, sizeof cells);
        patch.corners[4] = cells[0];
        patch.axis = axis;
    }

    // Of a patch that complex cells are part of finds the corners.
    HWY_INLINE void resolve(const Patch& patch) {
        Corners found;
        for (std::size_t c = 0; c < 4; ++c) {
            const std::uint32_t cell = patch.corners[c];
            const PatchCorner& corner = corners_[cell];
            const std::uint32_t edges_before = corner.number[1] & kEdgesBefore[patch.axis][c];
            const std::uint32_t of_edge =
                corner.number[0] + static_cast<std::uint32_t>(__builtin_popcount(edges_before));
            // Not a choice between two, which would be mispredicted.
            found[c] = cell ^ ((cell ^ of_edge) & (corner.is_complex() ? ~0u : 0u));
        }
        // The face between a cell and the next is the lower one of whichever lies higher.
        const auto [u, v] = kAcross[patch.axis];
        const std::uint8_t knots[4] = {corners_[found[1]].knot[u], corners_[found[2]].knot[v],
                                       corners_[found[2]].knot[u], corners_[found[3]].knot[v]};
        if ((knots[0] | knots[1] | knots[2] | knots[3]) == 0)
            put(0, found, patch.axis);
        else
            make_with_knots(found, knots);
    }

    // From an end of the shorter diagonal.
    HWY_INLINE void make(const Patch& patch) {
        const auto corner = [&](std::size_t c) -> const PatchCorner& { return corners_[patch.corners[c]]; };
        // Not a choice between two, which would be mispredicted at every other edge.
        const std::size_t from =
            first_diagonal_is_shorter(corner(0).at, corner(1).at, corner(2).at, corner(3).at) ? 0 : 1;
        // The numbers of both labels, which are together in memory, from four cells.
        using Two = std::uint64_t __attribute__((vector_size(16)));
        const auto numbers = [&](std::size_t c) {
            std::uint64_t both;
            std::memcpy(&both, &corner(from + c).number, sizeof both);
            return both;
        };
        const auto some = reinterpret_cast<Corners>(Two{numbers(0), numbers(1)}),
                   others = reinterpret_cast<Corners>(Two{numbers(2), numbers(3)});
        const Corners lesser = __builtin_shufflevector(some, others, 0, 2, 4, 6),
                      greater = __builtin_shufflevector(some, others, 1, 3, 5, 7);
        const EndPlaces places = corner(2).places;
        const Place straight = mirrored_ ? places.upper : places.lower,
                    other = mirrored_ ? places.lower : places.upper;
        const Corners swapped = (lesser ^ greater) & (Corners{} - (straight > other ? 1u : 0u));
        writers_[straight].add(lesser ^ swapped);
        writers_[other].add_turned(greater ^ swapped);
    }

    // As a fan from the first knot: a diagonal beside it could be another patch's too, as the face has two knots.
    HWY_NOINLINE void make_with_knots(const Corners& quad, const std::uint8_t (&knots)[4]) {
        constexpr std::size_t kHigher[4] = {1, 2, 2, 3};
        std::array<std::uint32_t, 8> corners{};
        std::size_t size = 0, from = corners.size();
        for (std::size_t c = 0; c < 4; ++c) {
            corners[size++] = quad[c];
            if (knots[c] == 0) continue;
            from = std::min(from, size);
            corners[size++] = quad[kHigher[c]] + knots[c];
        }
        const EndPlaces places = corners_[quad[2]].places;
        for (std::size_t end = 0; end < 2; ++end) {
            TriangleWriter& writer = writers_[end == 0 ? places.lesser() : places.greater()];
            const bool turned = (end == 0) == ((places.lower > places.upper) != mirrored_);
            const auto next = [&](std::size_t n) { return n + 1 < size ? n + 1 : 0; };
            const auto number = [&](std::size_t n) { return corners_[corners[n]].number[end]; };
            for (std::size_t n = next(from); next(n) != from; n = next(n)) {
                const std::uint32_t b = number(n), c = number(next(n));
                writer.add(number(from), turned ? c : b, turned ? b : c);
            }
        }
    }

    const LabelNet& net_;
    const PatchCorner* corners_;
    const bool mirrored_;
    TriangleWriter* writers_;
    std::array<std::size_t, 2> size_{};
    // Those that plain cells alone are part of, or whose corners are found; and others.
    std::array<std::array<Patch, kRoom>, 2> waiting_;
};

void make_patches_of_slices(const LabelNet& net, bool mirrored, std::int64_t begin, std::int64_t end,
                            TriangleWriter* writers) {
    Patches patches(net, mirrored, writers);
    for (std::int64_t k = begin; k < end; ++k) {
        for (std::int64_t j = 0; j <= net.bits.dims[1]; ++j) patches.make_row(j, k);
    }
    patches.flush();
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(make_patches_of_slices);

void make_patches(const LabelNet& net, bool mirrored, std::int64_t begin, std::int64_t end,
                  TriangleWriter* writers) {
    HWY_DYNAMIC_DISPATCH(make_patches_of_slices)(net, mirrored, begin, end, writers);
}

}  // namespace marrow::internal
#endif
