/// The search for the nearest triangle under a tree of boxes, in vectors.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <marrow/buffer.h>
#include <marrow/mesh.h>
#include <marrow/volume.h>

namespace marrow::internal {

/// A triangle's corners and its index in the mesh.
struct PlacedCorners {
    Vec3f a, b, c;
    std::uint32_t triangle;
};

/// The boxes of up to eight things, axis by axis; those of nothing are empty: from infinity to minus infinity.
struct EightBoxes {
    static constexpr std::uint32_t kWidth = 8;
    float lower[3][kWidth], upper[3][kWidth];
};

/// A tree of boxes. Under a node are up to eight triangles, or up to eight nodes, one after the other.
struct BoxTree {
    struct Under {
        std::uint32_t first;
        std::uint16_t count;
        bool triangles;
    };
    /// How many nodes a search may have before it at most: under each of 64 levels, more than there can be, all but one.
    static constexpr std::size_t kMostSeen = 64 * EightBoxes::kWidth;

    Buffer<PlacedCorners> triangles;
    std::vector<Under> under;  ///< each node; node 0 is the root, and nodes come before those under them
    Buffer<EightBoxes> boxes;  ///< of what is under each node
};

struct FoundTriangle {
    double squared_distance;
    std::uint32_t triangle;
};

/// The nearest triangle that is no further than `most`, or the first found that is no further than `enough`; where
/// there is none, its squared distance is above that of `most`. With a guess, a node, looks there first, and leaves
/// there where the triangle was found. The same bits on every SIMD target. \pre the tree has triangles
FoundTriangle find_nearest(const BoxTree& tree, const Vec3d& place, double enough, double most,
                           std::uint32_t* guess);

}  // namespace marrow::internal
