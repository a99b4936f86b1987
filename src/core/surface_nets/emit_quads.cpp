// Writes the quads of crossed edges to the meshes of the labels at both ends of each edge.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/surface_nets/emit_quads.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <bit>

#include "pending_quad.h"
#include "writers.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

// Emits the quads of edges. This is not vector code, but it needs each target's population count, which finds
// the cells around an edge: without it, writing the meshes takes a fifth longer.
//
// Quads wait until a row is complete, or some hundreds are together. Their number varies from word to word of
// the edges' bits, so a loop over the quads of one word would end in a mispredicted branch. The order within
// a row depends on this row alone: parts of whole rows write it as the whole does.
class QuadEmitter {
  public:
    QuadEmitter(const SurfaceNet& net, bool mirrored, TriangleWriter* writers)
        : net_(net), corners_(net.corners.data()), mirrored_(mirrored), writers_(writers) {}

    // Adds the quads of the edges that begin in a row of samples.
    void add_row(std::int64_t j, std::int64_t k) {
        const BorderBits& bits = net_.bits;
        // The rows of cells around the row of samples. At the ends of the map any row will do: no edge beside
        // it is crossed.
        const std::int64_t lower_j = std::max<std::int64_t>(j - 1, 0),
                           lower_k = std::max<std::int64_t>(k - 1, 0);
        const CellRow rows[4] = {CellRow(bits, lower_j, lower_k), CellRow(bits, j, lower_k),
                                 CellRow(bits, lower_j, k), CellRow(bits, j, k)};
        std::uint64_t carry_y = 0, carry_z = 0;  // whether the cells before the word are multi-label cells
        const std::size_t row = bits.first_word(j, k);
        for (std::size_t w = 0; w < bits.words; ++w) {
            const std::uint64_t x_edges = bits.crossed[0][row + w], y_edges = bits.crossed[1][row + w],
                                z_edges = bits.crossed[2][row + w];
            // Cell i of these two rows of cells lies at a y edge, or at a z edge. The bits tell whether one
            // of the two cells i is a multi-label cell.
            const std::uint64_t here = rows[3].multi_label[w], at_y = here | rows[1].multi_label[w],
                                at_z = here | rows[2].multi_label[w];
            if ((x_edges | y_edges | z_edges) != 0) {
                const CellWord words[4] = {rows[0].word(w), rows[1].word(w), rows[2].word(w),
                                           rows[3].word(w)};
                add<0>(x_edges, at_y | at_z | rows[0].multi_label[w], [&](std::uint64_t below) {
                    return Quad{words[0].id(below), words[1].id(below), words[3].id(below),
                                words[2].id(below)};
                });
                add<1>(y_edges, at_y | at_y << 1 | carry_y, [&](std::uint64_t below) {
                    const std::uint32_t lower = words[1].id(below), upper = words[3].id(below);
                    return Quad{lower - 1, upper - 1, upper, lower};
                });
                add<2>(z_edges, at_z | at_z << 1 | carry_z, [&](std::uint64_t below) {
                    const std::uint32_t lower = words[2].id(below), upper = words[3].id(below);
                    return Quad{lower - 1, lower, upper, upper - 1};
                });
            }
            carry_y = at_y >> 63;
            carry_z = at_z >> 63;
        }
        flush();
    }

  private:
    static constexpr std::size_t kCapacity = 256;
    // Quads whose corners are known, and quads with a multi-label cell whose corner must be found.
    static constexpr std::size_t kResolved = 0, kUnresolved = 1;

    // Writes the quads that wait.
    void flush() {
        for (std::size_t n = 0; n < count_[kUnresolved]; ++n) resolve(waiting_[kUnresolved][n]);
        for (std::size_t n = 0; n < count_[kResolved]; ++n) write(waiting_[kResolved][n]);
        count_ = {};
    }

    // `cells` returns the four cells around an edge, given the bits below that of the edge.
    template <std::uint32_t kAxis, class Cells>
    HWY_INLINE void add(std::uint64_t edges, std::uint64_t multi_label, const Cells& cells) {
        if (count_[kResolved] + count_[kUnresolved] + 64 > kCapacity) flush();
        for (std::uint64_t left = edges; left != 0; left &= left - 1) {
            const std::uint64_t bit = left & -left;
            wait((multi_label & bit) != 0 ? kUnresolved : kResolved, cells(bit - 1), kAxis);
        }
    }
    HWY_INLINE void wait(std::size_t kind, const Quad& corners, std::uint32_t axis) {
        waiting_[kind][count_[kind]++] = {{corners[0], corners[1], corners[2], corners[3], corners[0]}, axis};
    }

    // Replaces the corners of multi-label cells by those of the edge.
    HWY_INLINE void resolve(const PendingQuad& quad) {
        Quad found;
        for (std::size_t c = 0; c < 4; ++c) {
            const std::uint32_t cell = quad.corners[c];
            const QuadCorner& corner = corners_[cell];
            const std::uint32_t edges_before = corner.crossed_edges() & kEdgesBefore[quad.axis][c];
            const std::uint32_t of_edge =
                corner.first_corner() + static_cast<std::uint32_t>(std::popcount(edges_before));
            // A branch would be mispredicted.
            found[c] = cell ^ ((cell ^ of_edge) & (corner.is_multi_label_cell() ? ~0u : 0u));
        }
        // The face between two neighbouring cells is a lower face of the one with the higher index.
        const auto [u, v] = kOtherAxes[quad.axis];
        const std::array<std::uint8_t, 4> junctions = {
            corners_[found[1]].junction[u], corners_[found[2]].junction[v], corners_[found[2]].junction[u],
            corners_[found[3]].junction[v]};
        if ((junctions[0] | junctions[1] | junctions[2] | junctions[3]) == 0)
            wait(kResolved, found, quad.axis);
        else
            write_with_junctions(found, junctions);
    }

    // Divides a quad along its shorter diagonal.
    HWY_INLINE void write(const PendingQuad& quad) {
        const auto corner = [&](std::size_t c) -> const QuadCorner& { return corners_[quad.corners[c]]; };
        // A branch would be mispredicted at every other edge.
        const std::size_t first = first_diagonal_is_shorter(corner(0).position, corner(1).position,
                                                            corner(2).position, corner(3).position)
                                      ? 0
                                      : 1;
        const LabelPair labels = corner(2).labels;
        const LabelIndex straight = mirrored_ ? labels.upper : labels.lower,
                         flipped = mirrored_ ? labels.lower : labels.upper;
        const std::size_t of_straight = straight > flipped ? 1 : 0;
        Quad straight_points, flipped_points;
        for (std::size_t c = 0; c < 4; ++c) {
            const std::array<std::uint32_t, 2>& points = corner(first + c).point;
            straight_points[c] = points[of_straight];
            flipped_points[c] = points[1 - of_straight];
        }
        writers_[straight].write_quad(straight_points);
        writers_[flipped].write_flipped_quad(flipped_points);
    }

    // Writes a quad with further corners at junctions, as a fan from the first junction. A diagonal beside a
    // junction could also be that of another quad, because the face has two junctions.
    HWY_NOINLINE void write_with_junctions(const Quad& quad, const std::array<std::uint8_t, 4>& junctions) {
        constexpr std::size_t kHigherCell[4] = {1, 2, 2, 3};  // of cells c and c + 1 around the edge
        std::array<std::uint32_t, 8> corners{};
        std::size_t size = 0, first = corners.size();
        for (std::size_t c = 0; c < 4; ++c) {
            corners[size++] = quad[c];
            if (junctions[c] == 0) continue;
            first = std::min(first, size);
            corners[size++] = quad[kHigherCell[c]] + junctions[c];
        }
        const LabelPair labels = corners_[quad[2]].labels;
        for (std::size_t end = 0; end < 2; ++end) {
            TriangleWriter& writer = writers_[end == 0 ? labels.lesser() : labels.greater()];
            const bool flipped = (end == 0) == ((labels.lower > labels.upper) != mirrored_);
            const auto next = [&](std::size_t n) { return n + 1 < size ? n + 1 : 0; };
            const auto point = [&](std::size_t n) { return corners_[corners[n]].point[end]; };
            for (std::size_t n = next(first); next(n) != first; n = next(n)) {
                const std::uint32_t b = point(n), c = point(next(n));
                writer.write({point(first), flipped ? c : b, flipped ? b : c});
            }
        }
    }

    const SurfaceNet& net_;
    const QuadCorner* corners_;
    const bool mirrored_;
    TriangleWriter* writers_;
    std::array<std::size_t, 2> count_{};
    std::array<std::array<PendingQuad, kCapacity>, 2> waiting_;
};

void emit_quads_of_slices(const SurfaceNet& net, bool mirrored, std::int64_t begin, std::int64_t end,
                          TriangleWriter* writers) {
    QuadEmitter emitter(net, mirrored, writers);
    for (std::int64_t k = begin; k < end; ++k) {
        for (std::int64_t j = 0; j < net.bits.cell_rows(); ++j) emitter.add_row(j, k);
    }
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(emit_quads_of_slices);

void emit_label_quads(const SurfaceNet& net, bool mirrored, std::int64_t begin, std::int64_t end,
                      TriangleWriter* writers) {
    HWY_DYNAMIC_DISPATCH(emit_quads_of_slices)(net, mirrored, begin, end, writers);
}

}  // namespace marrow::internal
#endif
