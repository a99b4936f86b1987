/// The patch of a crossed grid edge: a quad between the points of the four cells round it, which the labels at both ends have.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include <marrow/mesh.h>

#include "label_net.h"

namespace marrow::internal {

/// The active cells round a grid edge, counter-clockwise seen from its upper end. The edge begins at corner 0 of the third.
using EdgeCells = std::array<std::uint32_t, 4>;

/// A quad's points in a label's mesh.
using Corners = std::uint32_t __attribute__((vector_size(16)));

/// Where a label's next triangle goes. Steps of 0: the background's, which are all dropped: a branch would be mispredicted at
/// every other border.
struct TriangleWriter {
    Triangle* next;
    std::size_t step;

    /// Both triangles of a quad.
    void add(Corners q) {
        put(__builtin_shufflevector(q, q, 0, 1, 2, 0), __builtin_shufflevector(q, q, 2, 3, 2, 3));
    }
    /// Of a quad turned over.
    void add_turned(Corners q) {
        put(__builtin_shufflevector(q, q, 0, 3, 2, 0), __builtin_shufflevector(q, q, 2, 1, 2, 1));
    }
    void add(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        next[0] = {a, b, c};
        next += step;
    }

  private:
    void put(Corners four, Corners two) {
        std::memcpy(next, &four, 16);
        std::memcpy(reinterpret_cast<char*>(next) + 16, &two, 8);
        next += 2 * step;
    }
};

/// Whether the diagonal between the first and third of four points is not longer than the other.
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

/// The same corners, from an end of the shorter diagonal on.
inline EdgeCells from_shorter_diagonal(const NetPoint* points, const EdgeCells& round) {
    // Not a choice between two, which would be mispredicted at every other edge.
    const std::uint32_t twice[5] = {round[0], round[1], round[2], round[3], round[0]};
    const std::size_t from =
        first_diagonal_is_shorter(points[round[0]], points[round[1]], points[round[2]], points[round[3]]) ? 0
                                                                                                          : 1;
    return {twice[from], twice[from + 1], twice[from + 2], twice[from + 3]};
}

/// Makes the patches that complex cells are part of.
class ComplexPatches {
  public:
    ComplexPatches(const LabelNet& net, bool mirrored, TriangleWriter* writers)
        : net_(net), mirrored_(mirrored), writers_(writers) {}
    /// To edges between slices of cells lower_k and k.
    void move_to(std::int64_t lower_k, std::int64_t k) {
        pieces_ = {&net_.piece_of_slice(lower_k), &net_.piece_of_slice(k)};
    }
    void add(std::size_t axis, const EdgeCells& round);

  private:
    const LabelNet& net_;
    const bool mirrored_;
    TriangleWriter* writers_;
    std::array<const NetPiece*, 2> pieces_{};
};

}  // namespace marrow::internal
