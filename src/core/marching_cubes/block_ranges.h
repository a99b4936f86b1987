/// The min-max pyramid's base: what values lie in each block of samples.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace marrow::internal {

/// What the samples of a block are for an isovalue.
enum class BlockState { outside, inside, mixed };

/// Bounds of a block's samples, rounded away from them where a float does not hold them exactly. With a
/// sample that is not finite, min is -infinity: such a block is never inside as a whole.
struct BlockRange {
    float min, max;

    BlockState state(double isovalue) const {
        if (static_cast<double>(max) < isovalue) return BlockState::outside;
        return static_cast<double>(min) >= isovalue ? BlockState::inside : BlockState::mixed;
    }
};

/// The ranges of blocks of 64 samples along x (a word of inside bits) by kRows rows of a slice. They do not
/// depend on the isovalue: when that changes, only blocks that it or the isovalue before lies in need another
/// look.
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
