// Divides space into blocks, and looks for columns of them in which the surface is a height field. Highway
// compiles this file once for each SIMD target.
//
// A column is a row of successive blocks along an axis, as long as some triangle is in each two of them.
// Triangles are in all blocks that their bounding boxes overlap, so the surface only leaves a column
// sideways. Suppose that all triangles of a column show the same side along the axis, and that each of
// their edges has two triangles. Then where a triangle ends within the column, another one continues on the
// far side of the edge. So all lines along the axis within the column meet the same number of its
// triangles. If that is one, then the surface is a height field there: no triangle is above another one,
// and they only meet in the edges and corners that they share. If it is none, then they are beside the
// column, although their bounding boxes are not.
//
// Two triangles can only intersect in a block that both are in, and that is in no such column, along any
// axis.
//
// The loops over blocks are plain ones, which compilers turn into vectors.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "mesh/intersections/height_fields.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "height_fields.h"

#include "base/parallel.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

// Whether a column is a height field along an axis.
HWY_INLINE std::uint8_t is_height_field(BlockBits column, int axis) {
    const int bits = column >> axis;
    return static_cast<std::uint8_t>((bits ^ bits / kBack) & ~(bits / kMoreOnLine) & 1);
}

// Returns all bits if a block is linked to the next one along an axis, otherwise none.
HWY_INLINE BlockBits all_if_linked(BlockBits block, int axis) {
    return static_cast<BlockBits>(-(block / kLinked >> axis & 1));
}

// Sets `unproven` to 0 for the blocks of a layer in columns that are height fields. The columns go along
// `axis`, side by side. `scratch` is as large as the layer.
HWY_INLINE void prove_side_by_side(const BlockBits* blocks, std::size_t columns, std::size_t length,
                                   std::size_t stride, int axis, BlockBits* scratch, std::uint8_t* unproven) {
    // What is known of each block and those before it in its column.
    for (std::size_t i = 0; i < columns; ++i) scratch[i] = blocks[i];
    for (std::size_t k = 1; k < length; ++k) {
        const BlockBits *const now = blocks + k * stride, *const previous = now - stride;
        const BlockBits* const before = scratch + (k - 1) * columns;
        BlockBits* const to = scratch + k * columns;
        for (std::size_t i = 0; i < columns; ++i)
            to[i] = merged(before[i] & all_if_linked(previous[i], axis), now[i]);
    }
    // The last block of a column knows it all.
    for (std::size_t k = length; k-- > 0;) {
        const BlockBits* const block = blocks + k * stride;
        BlockBits* const now = scratch + k * columns;
        const BlockBits* const after = k + 1 < length ? now + columns : now;
        std::uint8_t* const to = unproven + k * stride;
        for (std::size_t i = 0; i < columns; ++i) {
            const BlockBits linked = all_if_linked(block[i], axis);
            const auto column = static_cast<BlockBits>((after[i] & linked) | (now[i] & ~linked));
            now[i] = column;
            to[i] = static_cast<std::uint8_t>(to[i] & ~is_height_field(column, axis));
        }
    }
}

// The same for a single column along the x axis.
HWY_INLINE void prove_row(const BlockBits* blocks, std::size_t length, std::uint8_t* unproven) {
    constexpr std::size_t kTogether = sizeof(std::uint64_t) / sizeof(BlockBits);
    for (std::size_t i = 0; i < length; ++i) {
        // Most blocks have no triangles.
        for (std::uint64_t several = 0; i + kTogether <= length; i += kTogether) {
            std::memcpy(&several, blocks + i, sizeof several);
            if (several != 0) break;
        }
        while (i < length && blocks[i] == 0) ++i;
        if (i == length) return;
        const std::size_t begin = i;
        BlockBits column = blocks[i];
        while ((blocks[i] & kLinked) != 0) column = merged(column, blocks[++i]);
        if (is_height_field(column, 0) != 0) std::fill(unproven + begin, unproven + i + 1, std::uint8_t{0});
    }
}

// Looks at the columns along x and y in slice z.
void prove_slice(const BlockGrid& grid, const BlockBits* blocks, std::size_t z, BlockBits* scratch,
                 std::uint8_t* unproven) {
    const std::size_t nx = grid.blocks[0], ny = grid.blocks[1], first = z * nx * ny;
    std::fill_n(unproven + first, nx * ny, std::uint8_t{1});
    for (std::size_t y = 0; y < ny; ++y) prove_row(blocks + first + y * nx, nx, unproven + first + y * nx);
    prove_side_by_side(blocks + first, nx, ny, nx, 1, scratch, unproven + first);
}

// Looks at the columns along z with this y, after those along x and y.
void prove_wall(const BlockGrid& grid, const BlockBits* blocks, std::size_t y, BlockBits* scratch,
                std::uint8_t* unproven) {
    const std::size_t nx = grid.blocks[0], ny = grid.blocks[1];
    prove_side_by_side(blocks + y * nx, nx, grid.blocks[2], nx * ny, 2, scratch, unproven + y * nx);
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(prove_slice);
HWY_EXPORT(prove_wall);

namespace {

// Returns what is known of each block. Each thread looks at all triangles, and fills some slices.
Buffer<BlockBits> fill_blocks(const TriangleBlocks& placed) {
    // Two blocks are read and written as one number.
    static_assert(std::endian::native == std::endian::little &&
                  2 * sizeof(BlockBits) == sizeof(std::uint32_t));
    const BlockGrid& grid = placed.grid;
    Buffer<BlockBits> blocks(grid.size());
    const SpanRows span_rows(grid);
    const auto parts = static_cast<std::size_t>(thread_count());
    parallel_for(std::size_t{0}, parts, [&](std::size_t part) {
        const auto first_block = [&](std::size_t i) {
            return static_cast<std::uint32_t>(grid.blocks[2] * i / parts * grid.blocks[1] * grid.blocks[0]);
        };
        const std::uint32_t begin = first_block(part), size = first_block(part + 1) - begin;
        std::fill_n(blocks.data() + begin, size, BlockBits{0});
        // In local variables, as compilers load other ones again after each block that is written.
        const std::span<const std::uint32_t> spans = placed.spans;
        const std::uint8_t* const sides = placed.sides.data();
        BlockBits* const to = blocks.data();
        for (std::size_t t = 0; t < spans.size(); ++t) {
            const std::uint32_t span = spans[t];
            if (span == TriangleBlocks::kLarge) continue;
            const std::uint32_t first = SpanRows::first(span);
            const std::array<SpanRows::Row, 4>& rows = span_rows.rows(span);
            const std::uint32_t all_sides = sides[t] * (1 | SpanRows::has_next(span) << 16);
            if (first - begin < size && first + rows[3].first + 1 - begin < size) {
                // All are read before the first one is written, as this need not wait.
                std::uint32_t pairs[4];
                for (std::size_t i = 0; i < 4; ++i)
                    std::memcpy(&pairs[i], to + first + rows[i].first, sizeof pairs[i]);
                for (std::size_t i = 0; i < 4; ++i) {
                    pairs[i] |= all_sides | rows[i].links;
                    std::memcpy(to + first + rows[i].first, &pairs[i], sizeof pairs[i]);
                }
                continue;
            }
            for (const SpanRows::Row& row : rows) {
                const std::uint32_t block = first + row.first, bits = all_sides | row.links;
                if (block - begin < size) to[block] |= static_cast<BlockBits>(bits);
                if (block + 1 - begin < size) to[block + 1] |= static_cast<BlockBits>(bits >> 16);
            }
        }
        for (const std::vector<TriangleBlocks::Mark>& section : placed.marks) {
            for (const TriangleBlocks::Mark& mark : section)
                if (mark.block - begin < size) blocks[mark.block] = merged(blocks[mark.block], mark.bits);
        }
    });
    return blocks;
}

// Returns 0 for blocks in columns that are height fields, and 1 for the others.
Buffer<std::uint8_t> find_unproven(const BlockGrid& grid, const Buffer<BlockBits>& blocks) {
    Buffer<std::uint8_t> unproven(grid.padded_size());
    std::fill(unproven.begin() + static_cast<std::ptrdiff_t>(grid.size()), unproven.end(), std::uint8_t{0});
    const auto for_each_layer = [&](std::size_t layers, const auto& prove) {
        parallel_for_ranges(std::size_t{0}, layers, 8, [&](const auto& range) {
            Buffer<BlockBits> scratch(grid.size() / layers);
            for (std::size_t i = range.begin(); i < range.end(); ++i)
                prove(grid, blocks.data(), i, scratch.data(), unproven.data());
        });
    };
    for_each_layer(grid.blocks[2], HWY_DYNAMIC_DISPATCH(prove_slice));
    for_each_layer(grid.blocks[1], HWY_DYNAMIC_DISPATCH(prove_wall));
    return unproven;
}

}  // namespace

Buffer<std::uint8_t> blocks_outside_height_fields(const TriangleBlocks& placed) {
    return find_unproven(placed.grid, fill_blocks(placed));
}

}  // namespace marrow::internal
#endif
