/// Finds the pairs of triangles of a mesh whose bounding boxes overlap in some blocks of space, with SIMD.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <marrow/buffer.h>
#include <marrow/mesh.h>

#include "mesh/search/triangle_pyramid.h"
#include "triangle_blocks.h"

namespace marrow::internal {

/// Compares the triangles of each block with each other.
class BlockPairs {
  public:
    /// Looks at the blocks whose entry in `wanted` is 1 instead of 0; it has padded_size() entries.
    /// `numbers` are those that the triangles of `mesh` have in `placed`; they include all triangles in such
    /// blocks. `simple` is 1 for points at which no two triangles need to be looked at, and 0 for the others.
    /// Refers to all of these but `numbers`. Runs on all threads.
    BlockPairs(MeshView mesh, const TriangleBlocks& placed, const Buffer<std::uint32_t>& numbers,
               const Buffer<std::uint8_t>& wanted, const Buffer<std::uint8_t>& simple);

    /// The number of parts of the work of pairs_in(), at least 1.
    std::size_t parts() const { return parts_; }

    /// Appends the pairs of triangles whose boxes overlap or touch in the blocks of a part, some of them more
    /// than once. Leaves out those that share a point if one of the two has only simple points. In blocks
    /// with more than kMostInBlock triangles, it looks for no pairs and appends the triangles to `crowded`.
    void pairs_in(std::size_t part, std::vector<TrianglePair>& pairs,
                  std::vector<std::uint32_t>& crowded) const;

    static constexpr std::size_t kMostInBlock = 128;

    /// A triangle in a block.
    struct Entry {
        std::uint32_t block, triangle;
    };

    /// Calls f(the entries of a block) for each block of sorted entries.
    template <class F>
    static void for_each_block(std::span<const Entry> entries, const F& f) {
        for (std::size_t begin = 0, end = 0; begin < entries.size(); begin = end) {
            while (end < entries.size() && entries[end].block == entries[begin].block) ++end;
            f(entries.subspan(begin, end - begin));
        }
    }

  private:
    // Successive triangles, and the first and the last of their blocks.
    struct Section {
        Buffer<Entry> entries;
        std::uint32_t first = ~std::uint32_t{0}, last = 0;
    };

    const MeshView mesh_;
    const BlockGrid& grid_;
    const Buffer<std::uint8_t>&wanted_, &simple_;
    std::vector<Section> sections_;
    std::size_t parts_ = 1;
};

}  // namespace marrow::internal
