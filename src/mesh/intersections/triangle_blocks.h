/// Blocks of space, and which of them the triangles of a mesh are in.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <marrow/buffer.h>
#include <marrow/mesh.h>
#include <marrow/vector.h>

#include "mesh/connectivity/one_rings.h"
#include "mesh/geometry/bounds.h"
#include "mesh/search/triangle_tree.h"

namespace marrow::internal {

/// A grid of equal blocks over the points of a mesh. It numbers half blocks along each axis by
/// float operations that never decrease with the coordinate. So all points between two others are
/// in the half blocks between theirs.
struct BlockGrid {
    /// A block's index takes as many bits. The rest of a span says how many blocks follow the first.
    static constexpr int kIndexBits = 28;

    Vec3f lower, upper;            ///< the bounds of the points, mm
    float half_side = 0;           ///< of a block, mm
    float halves_per_mm = 0;       ///< half blocks
    std::uint32_t blocks[3] = {};  ///< along each axis; fewer than 2^kIndexBits in all
    Vec3d line_error = {};         ///< the most by which line() is off, mm
    /// By axis: the most by which twice the area of a triangle between an edge and a line along the axis is
    /// off, mm2. It holds for edges that are in two successive blocks at most along the other axes.
    Vec3f turn_error = {};

    std::uint32_t half_block(std::size_t axis, float x) const {
        return static_cast<std::uint32_t>((x - lower[axis]) * halves_per_mm);
    }
    /// The line of a block, which is where its first half ends. No point of type float is there: what begins
    /// in the first half and ends in the second crosses the line.
    double line(std::size_t axis, std::uint32_t block) const {
        return double{lower[axis]} + (2.0 * block + 1) / double{halves_per_mm};
    }
    std::size_t size() const { return std::size_t{blocks[0]} * blocks[1] * blocks[2]; }
    /// The size of an array with an entry for each block, and more, so that those next to it along the axes
    /// can be read, too.
    std::size_t padded_size() const { return size() + index({1, 1, 1}); }
    std::uint32_t index(const std::array<std::uint32_t, 3>& block) const {
        return (block[2] * blocks[1] + block[1]) * blocks[0] + block[0];
    }
};

/// What is known of the triangles in a block: for each of these, three bits, one per axis.
using BlockBits = std::uint16_t;
inline constexpr BlockBits kFront = 1 << 0;   ///< some triangle may face along the axis
inline constexpr BlockBits kBack = 1 << 3;    ///< some triangle may face against the axis
inline constexpr BlockBits kOnLine = 1 << 6;  ///< the line through the middle of the block meets a triangle
inline constexpr BlockBits kMoreOnLine = 1 << 9;  ///< it may meet more than one
inline constexpr BlockBits kLinked = 1 << 12;  ///< some triangle may also be in the next block along the axis
inline constexpr BlockBits kAllAxes = 0b111;

/// What is known of two sets of triangles together.
constexpr BlockBits merged(BlockBits a, BlockBits b) {
    const unsigned twice = a & b & kAllAxes * kOnLine;
    return static_cast<BlockBits>(a | b | twice * (kMoreOnLine / kOnLine));
}

/// Which blocks the triangles of a mesh are in: those that their bounding boxes overlap. Also which
/// sides they show along the axes.
struct TriangleBlocks {
    static constexpr std::uint32_t kLarge = ~std::uint32_t{0};
    /// Adds to what is known of a block.
    struct Mark {
        std::uint32_t block;
        BlockBits bits;
    };

    BlockGrid grid;
    /// The index of the first block of each triangle, and for each axis a bit: whether it is in the next
    /// block, too. kLarge if it is in more blocks, or crosses two lines on an axis.
    Buffer<std::uint32_t> spans;
    /// kFront and kBack; both at points that are no fans, and if rounding could be wrong.
    Buffer<std::uint8_t> sides;
    /// Where lines meet triangles, and the sides of large triangles, by sections of triangles.
    std::vector<std::vector<Mark>> marks;
};

/// The blocks of spans. They are in rows along x: each is a first block, and maybe the next one.
class SpanRows {
  public:
    /// A row, relative to the first block of all. Some rows are listed more than once.
    struct Row {
        std::uint32_t first;
        std::uint32_t links;  ///< kLinked for its first block, and in the upper half for the next one
    };

    explicit SpanRows(const BlockGrid& grid) {
        for (std::uint32_t span = 0; span < 8; ++span) {
            near_[span] = grid.index({span & 1, span >> 1 & 1, span >> 2});
            for (std::uint32_t row = 0; row < 4; ++row) {
                const std::uint32_t at = span & 2 * row, linked = span & ~at;
                // The next block is the last one along x.
                const std::uint32_t next = has_next(span << BlockGrid::kIndexBits) * (linked & ~1u) * kLinked;
                rows_[span][row] = {grid.index({0, at >> 1 & 1, at >> 2}), linked * kLinked | next << 16};
            }
        }
    }
    static std::uint32_t first(std::uint32_t span) { return span % (1u << BlockGrid::kIndexBits); }
    /// Which blocks there are: a bit for each axis, as in TriangleBlocks::spans.
    static std::uint32_t kind(std::uint32_t span) { return span >> BlockGrid::kIndexBits & 7; }
    /// 1 if the rows have two blocks, otherwise 0.
    static std::uint32_t has_next(std::uint32_t span) { return kind(span) & 1; }
    const std::array<Row, 4>& rows(std::uint32_t span) const { return rows_[kind(span)]; }
    /// Calls f(index, 1 if the span has this block and 0 if not) for its first block and the seven behind it.
    /// Without branches, as it is unpredictable which blocks there are.
    template <class F>
    void for_each_near(std::uint32_t span, const F& f) const {
        const std::uint32_t begin = first(span), missing = ~kind(span);
        for (std::uint32_t i = 0; i < 8; ++i) f(begin + near_[i], (i & missing) == 0 ? 1u : 0u);
    }

  private:
    std::array<std::array<Row, 4>, 8> rows_;
    std::array<std::uint32_t, 8> near_;  // relative to the first block
};

/// The first and the last half block of a triangle along each axis.
struct BlockReach {
    std::array<std::uint32_t, 3> low, high;

    BlockReach(const MeshView& mesh, const BlockGrid& grid, const Triangle& triangle) {
        const Bounds box = bounds_of(mesh, triangle);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            low[axis] = grid.half_block(axis, box.lower[axis]);
            high[axis] = grid.half_block(axis, box.upper[axis]);
        }
    }
    std::size_t blocks() const {
        std::size_t count = 1;
        for (std::size_t axis = 0; axis < 3; ++axis) count *= high[axis] / 2 - low[axis] / 2 + 1;
        return count;
    }
    /// Calls f(x, y, z as an array) for the blocks of the triangle.
    template <class F>
    void for_each_block(const F& f) const {
        std::array<std::uint32_t, 3> block;
        for (block[2] = low[2] / 2; block[2] <= high[2] / 2; ++block[2]) {
            for (block[1] = low[1] / 2; block[1] <= high[1] / 2; ++block[1]) {
                for (block[0] = low[0] / 2; block[0] <= high[0] / 2; ++block[0]) f(block);
            }
        }
    }
};

/// Finds the blocks of a mesh. Returns nothing if coordinates are not finite, or if the triangles are of too
/// different sizes. Runs on all threads. `rings` are those of the mesh. \pre fewer than 2^32 triangles
std::optional<TriangleBlocks> find_triangle_blocks(const MeshView& mesh, const OneRings& rings);

/// Returns the triangles with a block whose entry in `wanted` is 1 instead of 0, and large ones, in ascending
/// order. Runs on all threads. `wanted` has padded_size() entries.
Buffer<std::uint32_t> triangles_in(const TriangleBlocks& blocks, const Buffer<std::uint8_t>& wanted);

}  // namespace marrow::internal
