/// The search for the nearest triangle under a tree of boxes, in vectors.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <marrow/buffer.h>
#include <marrow/mesh.h>
#include <marrow/volume.h>

namespace marrow::internal {

/// A tree of boxes, eight under a node, and at its ends triangles, up to eight together.
struct BoxTree {
    static constexpr std::uint32_t kWidth = 8;

    /// By corner and axis. Behind the last triangle come copies of it.
    struct Leaf {
        float corners[3][3][kWidth];
        std::uint32_t triangle[kWidth];  ///< of the mesh
        std::uint32_t count;

        Vec3f corner(std::size_t corner, std::size_t i) const {
            return {corners[corner][0][i], corners[corner][1][i], corners[corner][2][i]};
        }
    };
    /// The boxes of what is under it, by axis, and what that is.
    struct Node {
        float lower[3][kWidth], upper[3][kWidth];
        std::uint32_t under[kWidth];  ///< a node, or kLeaf and a leaf
        std::uint32_t count;
    };
    static constexpr std::uint32_t kLeaf = std::uint32_t{1} << 31;
    /// How many nodes a search may have before it at most: under each of 64 levels, more than there can be, all but one.
    static constexpr std::size_t kMostSeen = 64 * kWidth;

    Buffer<Node> nodes;  ///< the root, and nodes before those under them
    Buffer<Leaf> leaves;
};

struct FoundTriangle {
    double squared_distance;
    std::uint32_t triangle;
};

/// The nearest triangle that is no further than `most`, or the first found that is no further than `enough`; where
/// there is none, its squared distance is above that of `most`. With a guess, a leaf, looks there first, and leaves
/// there where the triangle was found. The same bits on every SIMD target. \pre the tree has triangles
FoundTriangle find_nearest(const BoxTree& tree, const Vec3d& place, double enough, double most,
                           std::uint32_t* guess);

}  // namespace marrow::internal
