/// Searches a tree of bounding boxes for the nearest triangle, with SIMD.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include <marrow/buffer.h>
#include <marrow/vector.h>

namespace marrow::internal {

/// A bounding volume hierarchy: nodes have up to eight children, leaves up to eight triangles.
struct BoxTree {
    static constexpr std::uint32_t kWidth = 8;

    /// Triangles by corner and axis. Unused entries repeat the last triangle.
    struct Leaf {
        float corners[3][3][kWidth];
        std::uint32_t triangle[kWidth];  ///< the index in the mesh
        std::uint32_t count;

        Vec3f corner(std::size_t corner, std::size_t i) const {
            return {corners[corner][0][i], corners[corner][1][i], corners[corner][2][i]};
        }
    };
    /// The children and their boxes by axis.
    struct Node {
        float lower[3][kWidth], upper[3][kWidth];
        std::uint32_t child[kWidth];  ///< the index of a node, or kLeaf plus the index of a leaf
        std::uint32_t count;
    };
    static constexpr std::uint32_t kLeaf = std::uint32_t{1} << 31;
    /// An upper bound of the children that wait in a search: all but one at each level. There are fewer than
    /// 64 levels.
    static constexpr std::size_t kMaxPending = 64 * kWidth;

    Buffer<Node> nodes;  ///< the root first, and every node before its children
    Buffer<Leaf> leaves;
};

struct FoundTriangle {
    double squared_distance;
    std::uint32_t triangle;
};

/// Returns the nearest triangle within the distance `most`, or any triangle within the distance `enough`. If
/// no triangle is within `most`, the squared distance of the result is larger than most * most. The result
/// has the same bits on every SIMD target. \pre the tree has triangles
FoundTriangle find_nearest(const BoxTree& tree, const Vec3d& position, double enough, double most);

/// A position whose distance to the nearest triangle is wanted.
struct NearestQuery {
    Vec3d position;
    double enough = 0;            ///< any triangle within this distance will do
    double squared_distance = 0;  ///< set by the search
};
inline constexpr std::size_t kMostInGroup = 16;

/// Sets the squared distances of 1 to kMostInGroup positions, in less time if they are near each other.
/// Leaves within `reach` of them are listed, and searched one after the other for all positions; a position
/// with no triangle within `reach` is searched on its own. So `reach`, which need not be exact, should be a
/// little more than the largest distance.
void find_nearest(const BoxTree& tree, std::span<NearestQuery> queries, double reach);

}  // namespace marrow::internal
