/// The range of values in each block of samples, so that blocks which an isovalue does not touch need not be
/// read.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace marrow::internal {

/// Whether the samples of a block are all outside, all inside, or both.
enum class BlockState { outside, inside, mixed };

/// Bounds of a block's samples. Where float cannot hold them exactly they are rounded outwards. If a sample
/// is not finite, min is -infinity, so the block is never all inside.
struct BlockRange {
    float min, max;

    BlockState state(double isovalue) const {
        if (static_cast<double>(max) < isovalue) return BlockState::outside;
        return static_cast<double>(min) >= isovalue ? BlockState::inside : BlockState::mixed;
    }
};

/// The ranges of all blocks. A block has 64 samples along x (one word of inside bits) and kRows rows of a
/// slice. Ranges do not depend on the isovalue: when it changes, only blocks whose range holds the old or the
/// new isovalue change.
struct BlockRanges {
    static constexpr std::int64_t kRows = 8;

    std::int64_t blocks_x, blocks_y;
    std::vector<BlockRange> ranges;

    explicit BlockRanges(const std::array<std::int64_t, 3>& dims)
        : blocks_x((dims[0] + 63) / 64),
          blocks_y((dims[1] + kRows - 1) / kRows),
          ranges(static_cast<std::size_t>(blocks_x * blocks_y * dims[2])) {}

    BlockRange& at(std::int64_t block_x, std::int64_t block_y, std::int64_t z) {
        return ranges[static_cast<std::size_t>((z * blocks_y + block_y) * blocks_x + block_x)];
    }
    std::size_t bytes() const { return ranges.size() * sizeof(BlockRange); }
};

}  // namespace marrow::internal
